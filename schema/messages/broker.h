#pragma once
#include <cstdint>
#include <memory>
#include <string>

namespace vantage {

/// A hub for LCM's tcpq:// transport: relays what clients publish to the clients that subscribed.
/// Runs in a thread of its own until destroyed. One write per message, TCP_NODELAY and TCP_QUICKACK, so that a message
/// takes some 100 µs; a client that does not read loses its oldest messages and stops nobody else.
class Broker {
 public:
  struct Config {
    std::string host = "127.0.0.1";  ///< IPv4 address to listen at; "0.0.0.0" for all. LCM 1.3.1 has no IPv6.
    std::uint16_t port = 0;          ///< 0 = any free one
    std::size_t max_queue_bytes_per_client = std::size_t{64} << 20U;
    std::size_t max_clients = 4'000;
    std::size_t max_bytes_per_s_per_client = std::size_t{128} << 20U;  ///< who sends more is cut off
    std::int64_t hello_within_ms = 5'000;                              ///< who does not say what it is by then, too
  };
  struct Counts {
    std::int64_t num_clients = 0, num_relayed = 0;
    std::int64_t num_dropped = 0;   ///< messages for clients that do not read
    std::int64_t num_refused = 0;   ///< connections: too many, or no descriptors left
    std::int64_t num_silent = 0;    ///< connections closed: no hello in time
    std::int64_t num_nonsense = 0;  ///< connections closed: not LCM's protocol
    std::int64_t num_too_fast = 0;  ///< connections closed: too many bytes a second
  };
  /// Throws Error(BadInput) naming host and port when it cannot listen there.
  explicit Broker(const Config& config);
  ~Broker();
  Broker(const Broker&) = delete;
  Broker& operator=(const Broker&) = delete;

  std::uint16_t port() const;
  /// "tcpq://host:port", for clients on this machine.
  std::string url() const;
  Counts counts() const;

 private:
  class Hub;
  std::unique_ptr<Hub> hub_;
};

}  // namespace vantage
