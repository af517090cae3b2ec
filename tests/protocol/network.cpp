#include "tests/protocol/network.h"

namespace vantage {

void Network::send(const std::string& from, const std::string& to, const std::string& datagram) {
  const std::uint64_t serial = ++num_sent_;
  carry(from, to, {datagram, false}, serial);
  if (world_.calm) return;
  if (world_.dice.chance(weather_.duplicate, "duplicate", serial)) carry(from, to, {datagram, false}, serial);
  auto& all = sent_[{from, to}];
  all.push_back(datagram);
  if (world_.dice.chance(weather_.replay, "replay", serial))
    carry(from, to, {all[world_.dice.bits("which", serial) % all.size()], false}, serial);
}

void Network::carry(const std::string& from, const std::string& to, Delivery delivery, std::uint64_t serial) {
  const std::uint64_t copy = ++num_carried_;
  std::int64_t delay_ms = world_.dice.between(0, 3, "delay", serial, copy);
  if (!world_.calm) {
    if (world_.dice.chance(weather_.loss, "loss", serial, copy)) return;
    if (world_.dice.chance(weather_.corrupt, "corrupt", serial, copy)) damage(delivery, serial);
    // Mostly quick, now and then as late as can be.
    if (world_.dice.chance(0.3, "slow", serial, copy))
      delay_ms = world_.dice.between(0, weather_.max_delay_ms, "delay", serial, copy);
  }
  world_.after(delay_ms, [this, from, to, delivery = std::move(delivery)] {
    if (cuts_[from] > 0 || cuts_[to] > 0) return;
    if (const auto receiver = receivers_.find(to); receiver != receivers_.end()) receiver->second(delivery);
  });
}

void Network::damage(Delivery& delivery, std::uint64_t serial) const {
  std::string& bytes = delivery.datagram;
  delivery.damaged = true;
  if (world_.dice.chance(0.2, "cut short", serial)) {
    bytes.resize(world_.dice.bits("length", serial) % bytes.size());
    return;
  }
  bytes[world_.dice.bits("byte", serial) % bytes.size()] ^= static_cast<char>(1U << (serial % 8));
}

void Network::cut_off(const std::string& who, std::int64_t for_ms) {
  ++cuts_[who];
  world_.after(for_ms, [this, who] { --cuts_[who]; });
}

}  // namespace vantage
