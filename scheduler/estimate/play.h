#pragma once
#include <span>
#include <vector>

#include "scheduler/estimate/estimate.h"

namespace vantage {

/// Who waits for whom, turned around, so that many runs share it.
struct ItemGraph {
  explicit ItemGraph(std::span<const WorkItem> items);
  std::vector<int> num_needs;
  std::vector<int> first_dependent,
      dependents;  ///< of item i: dependents[first_dependent[i] .. first_dependent[i + 1])
};

/// Time until all items have ended, when a farm of this capacity always starts the ready item of the latest kind, then
/// of the smallest index. An item that asks for more cores than there are gets all of them.
double play(std::span<const WorkItem> items, const ItemGraph& graph, std::span<const double> durations_s,
            const Capacity& capacity);

}  // namespace vantage
