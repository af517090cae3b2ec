#pragma once
#include <chrono>
#include <cstddef>

namespace vantage {

/// What one client may cost the server. Every limit is answered with its own status, or by closing the connection.
struct HttpLimits {
  std::size_t max_body_bytes = 1'000'000;        ///< 413
  std::size_t max_head_bytes = 16'384;           ///< request line and headers together: 431
  std::size_t max_line_bytes = 8'000;            ///< one header line: 431; the request line: 414
  int max_connections = 128;                     ///< together; each may hold a thread: 503
  int max_per_address = 64;                      ///< 429
  int max_streams = 40;                          ///< event streams, which stay open: 503
  std::chrono::milliseconds head_time{5'000};    ///< first to last byte of a head, however slowly they drip: 408
  std::chrono::milliseconds body_time{20'000};   ///< of a body: the connection closes
  std::chrono::milliseconds idle_time{15'000};   ///< without a request: the connection closes
  std::chrono::milliseconds write_time{10'000};  ///< without the client taking a byte: the connection closes
  int max_requests_per_connection = 1000;
};

}  // namespace vantage
