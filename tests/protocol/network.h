#pragma once
/// Datagrams between the simulated scheduler and its workers, as bad as the weather says.
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/protocol/world.h"

namespace vantage {

struct Delivery {
  std::string datagram;
  bool damaged = false;  ///< must not be understood
};

class Network {
 public:
  using Receiver = std::function<void(const Delivery&)>;
  Network(World& world, Weather weather) : world_(world), weather_(weather) {}

  /// to: "scheduler" or a worker's id; alone decides who hears it.
  void connect(const std::string& to, Receiver receiver) { receivers_[to] = std::move(receiver); }
  void send(const std::string& from, const std::string& to, const std::string& datagram);
  /// Once, and it must not be understood.
  void send_damaged(const std::string& from, const std::string& to, const std::string& datagram) {
    carry(from, to, {datagram, true}, ++num_sent_);
  }
  /// Nothing comes from or to it while it is cut off.
  void cut_off(const std::string& who, std::int64_t for_ms);

 private:
  void carry(const std::string& from, const std::string& to, Delivery delivery, std::uint64_t serial);
  void damage(Delivery& delivery, std::uint64_t serial) const;

  World& world_;
  Weather weather_;
  std::map<std::string, Receiver> receivers_;
  std::map<std::string, int> cuts_;
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> sent_;  ///< everything, to be said again
  std::uint64_t num_sent_ = 0, num_carried_ = 0;
};

}  // namespace vantage
