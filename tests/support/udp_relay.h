#pragma once
/// Bad weather between the cables of a Network (Middle::Nothing): carries multicast datagrams from each to all others,
/// some late, twice, out of order or changed.
#include <atomic>
#include <cstdint>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/network.h"

namespace vantage {

class UdpRelay {
 public:
  struct Weather {
    int duplicate_percent = 0;
    int corrupt_percent = 0;  ///< one byte is changed
    int max_delay_ms = 0;     ///< each is late by its own time, so they overtake each other
  };
  /// ports: of the group 239.255.76.67 that are carried.
  UdpRelay(const Network& network, int num_hosts, std::vector<std::uint16_t> ports, unsigned seed);
  ~UdpRelay();
  UdpRelay(const UdpRelay&) = delete;
  UdpRelay& operator=(const UdpRelay&) = delete;

  void set_weather(const Weather& weather);
  /// From now on keeps what passes.
  void record();
  /// Sends again, to all hosts but its sender, what was recorded; returns how many datagrams.
  std::size_t replay();

  struct Counts {
    std::int64_t carried = 0, duplicated = 0, corrupted = 0, delayed = 0;
  };
  Counts counts() const;

 private:
  struct Socket {
    int fd = -1, host = 0;
    std::uint16_t port = 0;
  };
  struct Datagram {
    std::string bytes;
    int from_host = 0;
    std::uint16_t port = 0;
  };
  struct Pending {
    std::int64_t due_ms = 0;
    Datagram datagram;
  };

  void open_sockets(int num_hosts, const std::vector<std::uint16_t>& ports);
  void run();
  void take(const Socket& socket);
  void carry(Datagram datagram);
  void send(const Datagram& datagram);
  bool chance(int percent);

  std::vector<Socket> sockets_;
  std::atomic<bool> stop_ = false;
  mutable std::mutex mutex_;  ///< guards all below
  std::mt19937 random_;
  Weather weather_;
  bool recording_ = false;
  std::vector<Datagram> recorded_;
  std::vector<Pending> pending_;
  Counts counts_;
  std::thread thread_;
};

}  // namespace vantage
