#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "scheduler/api/http_library.h"
#include "scheduler/api/limits.h"

namespace vantage {

/// What must be known of a request before any of it is believed. From its head only.
struct RequestHead {
  std::uint64_t body_bytes = 0;
};

/// A request that is turned away before it is read any further.
struct EarlyAnswer {
  int status = 400;
  std::string why;  ///< one line
};

/// Sizes of the lines of a head, whole or not.
std::optional<EarlyAnswer> check_lines(std::string_view text, const HttpLimits& limits);
/// The framing of a head that ends with an empty line: one Content-Length at most, no chunks (a body's size must be
/// known beforehand). Either `head` is filled or an answer returned.
std::optional<EarlyAnswer> check_head(std::string_view text, const HttpLimits& limits, RequestHead& head);

/// "HTTP/1.1 413 …" with {"error": "…"}, closing.
std::string early_answer_text(const EarlyAnswer& answer);

/// One client's socket. httplib reads requests from it, but only within limits: heads come whole and in time, bodies
/// end where the head said. One thread; `open` turning false ends all waiting within 100 ms.
class Connection final : public httplib::Stream {
 public:
  Connection(int socket, const HttpLimits& limits, const std::atomic<bool>& stopping);

  enum class Next { Request, Closed, Refused };
  /// Waits for the next request's head. Refused: an answer was sent and the connection must be closed.
  Next await_request();
  /// The whole body was read, so that another request may follow.
  bool at_end_of_request() const { return body_left_ == 0; }
  void refuse(const EarlyAnswer& answer);
  /// Lets the client read the last answer although some of what it sent was not read.
  void linger();

  bool is_readable() const override;
  bool is_writable() const override;
  ssize_t read(char* bytes, size_t size) override;
  ssize_t write(const char* bytes, size_t size) override;
  void get_remote_ip_and_port(std::string& ip, int& port) const override;
  void get_local_ip_and_port(std::string& ip, int& port) const override;
  socket_t socket() const override { return socket_; }

 private:
  using Time = std::chrono::steady_clock::time_point;
  enum class Got { Bytes, End, Late };
  Got receive(Time until);
  bool wait_for(short events, Time until) const;

  int socket_;
  HttpLimits limits_;
  const std::atomic<bool>& stopping_;
  std::string buffer_;  ///< received, from position_ on not yet read
  std::size_t position_ = 0;
  std::size_t head_left_ = 0;  ///< of the buffer
  std::uint64_t body_left_ = 0;
  Time body_until_{};
};

/// IP address of the other end or of this one; IPv4 in IPv6 as IPv4. Empty when it is gone.
std::string address_of_peer(int socket);
std::string address_of_self(int socket);
bool is_loopback(const std::string& ip);

}  // namespace vantage
