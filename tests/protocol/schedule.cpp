#include "tests/protocol/schedule.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace vantage {
namespace {

/// Steele, Lea, Flood 2014: the finalizer of SplitMix64.
std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31U);
}

/// In half of the schedules none at all, so that other faults are seen alone, too.
double sometimes(const Dice& dice, double at_most, const char* what) {
  if (dice.chance(0.5, what, 0)) return 0;
  return at_most * static_cast<double>(dice.between(0, 1000, what, 1)) / 1000;
}

constexpr std::array<const char*, kNumFaultKinds> kFaultNames = {
    "kill scheduler", "kill worker", "stall scheduler", "stall worker", "cut worker off", "drain",
    "undrain",        "pause shot",  "resume shot",     "cancel job",   "retry shot",     "pause job",
    "resume job",     "retry job",   "resubmit",        "forge report", "forge foreign"};

}  // namespace

const char* to_string(FaultKind kind) { return kFaultNames.at(static_cast<std::size_t>(kind)); }

std::uint64_t Dice::bits(const char* what, std::uint64_t a, std::uint64_t b) const {
  std::uint64_t hash = mix(seed_);
  for (const char* c = what; *c != 0; ++c) hash = mix(hash ^ static_cast<unsigned char>(*c));
  return mix(mix(hash ^ a) ^ b);
}

bool Dice::chance(double probability, const char* what, std::uint64_t a, std::uint64_t b) const {
  return static_cast<double>(bits(what, a, b) >> 11U) * 0x1p-53 < probability;
}

std::int64_t Dice::between(std::int64_t low, std::int64_t high, const char* what, std::uint64_t a,
                           std::uint64_t b) const {
  return low + static_cast<std::int64_t>(bits(what, a, b) % static_cast<std::uint64_t>(high - low + 1));
}

Schedule random_schedule(std::uint64_t seed) {
  const Dice dice(seed);
  Schedule s;
  s.seed = seed;
  s.num_workers = static_cast<int>(dice.between(1, 4, "workers", 0));
  s.num_slots = static_cast<int>(dice.between(1, 3, "slots", 0));
  s.num_edges = static_cast<int>(dice.between(1, 6, "edges", 0));
  s.num_noops = static_cast<int>(dice.between(0, 4, "noops", 0));
  s.lease_ms = static_cast<int>(dice.between(1500, 5000, "lease", 0));
  s.faulty_ms = dice.between(2'000, 12'000, "faulty", 0);
  s.last_is_lost = s.num_workers > 1 && dice.chance(0.3, "lost", 0);
  s.weather = {.loss = sometimes(dice, 0.4, "loss"),
               .duplicate = sometimes(dice, 0.3, "duplicate"),
               .corrupt = sometimes(dice, 0.1, "corrupt"),
               .replay = sometimes(dice, 0.1, "replay"),
               .max_delay_ms = dice.chance(0.5, "delay", 0) ? 5 : dice.between(5, 3'000, "delay", 1)};
  s.fates = {.crash = sometimes(dice, 0.2, "crash"),
             .fail = sometimes(dice, 0.2, "fail"),
             .hang = sometimes(dice, 0.05, "hang"),
             .dies_after_commit = sometimes(dice, 0.2, "dies"),
             .late_storage = sometimes(dice, 0.2, "late")};
  const auto num_faults = static_cast<std::uint64_t>(dice.between(0, 12, "faults", 0));
  for (std::uint64_t i = 0; i < num_faults; ++i) {
    // Kills, stalls and cuts are what the protocol is for: as often as all else together.
    const auto kind =
        dice.chance(0.5, "fault", i) ? dice.between(0, 4, "common", i) : dice.between(0, kNumFaultKinds - 1, "kind", i);
    s.faults.push_back({.at_ms = dice.between(0, s.faulty_ms, "at", i),
                        .kind = static_cast<FaultKind>(kind),
                        .choice = dice.bits("choice", i),
                        .for_ms = dice.between(0, 2L * s.lease_ms, "for", i)});
  }
  std::stable_sort(s.faults.begin(), s.faults.end(), [](const auto& a, const auto& b) { return a.at_ms < b.at_ms; });
  return s;
}

std::string to_text(const Schedule& s) {
  std::string text = fmt::format(
      "seed {}: {} workers of {} slots, {} edges, {} jobs inside the workers, lease {} ms, {} ms of faults{}\n"
      "  datagrams: loss {:.3f}, duplicate {:.3f}, corrupt {:.3f}, replay {:.3f}, delay up to {} ms\n"
      "  jobs: crash {:.3f}, fail {:.3f}, hang {:.3f}, die after the commit {:.3f}, late storage {:.3f}\n",
      s.seed, s.num_workers, s.num_slots, s.num_edges, s.num_noops, s.lease_ms, s.faulty_ms,
      s.last_is_lost ? ", the last worker never comes back" : "", s.weather.loss, s.weather.duplicate,
      s.weather.corrupt, s.weather.replay, s.weather.max_delay_ms, s.fates.crash, s.fates.fail, s.fates.hang,
      s.fates.dies_after_commit, s.fates.late_storage);
  for (const Fault& f : s.faults)
    text +=
        fmt::format("  {:>6} ms: {} (choice {}, for {} ms)\n", f.at_ms, to_string(f.kind), f.choice % 1000, f.for_ms);
  return text;
}

}  // namespace vantage
