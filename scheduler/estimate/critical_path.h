#pragma once
#include <span>
#include <vector>

#include "scheduler/estimate/estimate.h"

namespace vantage {

struct CriticalPath {
  std::vector<int> items{};  ///< indices, in the order in which they run
  double length_s = 0;       ///< expected; with workers without end the shot would still take this long
};

/// The chain of items, each needing the one before, that takes longest. Kinds whose duration is not known take none.
/// Empty without items.
CriticalPath critical_path(std::span<const WorkItem> items, std::span<const KindKnowledge> kinds);

}  // namespace vantage
