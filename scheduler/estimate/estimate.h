#pragma once
/// How long a shot will still take, as an interval: list scheduling of what is left, played many times with durations
/// drawn from what was seen. Pure functions over values; the same input gives the same answer.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "scheduler/estimate/durations.h"

namespace vantage {

/// What is known of one kind, in the order of the pipeline.
struct KindKnowledge {
  std::string kind{};
  DurationStats stats{};     ///< num == 0: how long it takes is not known
  bool other_shots = false;  ///< stats come from other shots, this one has none yet
  /// How many of its jobs the plan still lacks, judged by earlier shots; empty: nobody knows. 0 when it is planned.
  std::optional<int> num_unplanned = 0;
  int cores = 1;  ///< of unplanned jobs
};

/// A job that is left, or several of one kind taken together: they run one after the other.
struct WorkItem {
  int kind = 0;  ///< index into the knowledge
  int num_jobs = 1;
  int cores = 1;
  double elapsed_s = -1;     ///< >= 0: runs already for so long
  std::vector<int> needs{};  ///< indices of items that must end first, all smaller than its own
};

struct Capacity {
  int num_slots = 0, num_cores = 0;  ///< of workers that take work, together
};

struct EstimateInput {
  std::vector<KindKnowledge> kinds{};
  std::vector<WorkItem> items{};  ///< planned and unfinished
  Capacity capacity{};
};

struct Estimate {
  double low_s = 0, middle_s = 0, high_s = 0;  ///< 10, 50 and 90 % of the played runs end before
  /// Kinds left out, because their number or their duration is not known: the true time is longer.
  std::vector<std::string> unknown_kinds{};
};

/// Empty when nobody takes work, or when nothing that is left is known.
std::optional<Estimate> estimate_rest(const EstimateInput& input, std::uint64_t seed = 1);

/// Items beyond this many should be taken together: playing costs as much as they are many.
constexpr std::size_t kMaxItems = 4000;

}  // namespace vantage
