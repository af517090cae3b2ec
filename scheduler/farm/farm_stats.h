#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <string>

#include "schema/base/histogram.h"

namespace vantage {

/// What keeps the farm from working, and how busy it is.
struct FarmHealth {
  std::string trouble{};           ///< one line for people; empty: all is well
  std::int64_t since_wall_ms = 0;  ///< of the trouble
};

inline constexpr std::array<double, 8> kTurnSeconds{0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.2, 1};

struct FarmStats {
  std::int64_t epoch = 0;                           ///< starts of the scheduler on this database
  std::int64_t num_turns = 0;                       ///< of the scheduler's thread: one transaction each
  std::int64_t num_reports = 0;                     ///< taken from workers
  std::int64_t num_waiting_reports = 0;             ///< received and not yet looked at
  std::int64_t num_claimed = 0;                     ///< attempts handed out
  std::map<std::string, std::int64_t> num_ended{};  ///< attempts, by outcome
  std::int64_t num_stalls = 0;                      ///< times that it stood still for a second or longer
  std::int64_t cpu_ms = 0;                          ///< of the thread
  Histogram<kTurnSeconds.size()> turn_s{};          ///< to decide and to make it durable
};

}  // namespace vantage
