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
  };
  struct Counts {
    std::int64_t num_clients = 0, num_relayed = 0, num_dropped = 0;
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
