#include "scheduler/estimate/critical_path.h"

#include <algorithm>

namespace vantage {

CriticalPath critical_path(std::span<const WorkItem> items, std::span<const KindKnowledge> kinds) {
  if (items.empty()) return {};
  std::vector<double> end_s(items.size());
  std::vector<int> previous(items.size(), -1);
  for (std::size_t i = 0; i < items.size(); ++i) {  // needs stand before
    double begin_s = 0;
    for (const int need : items[i].needs)
      if (const double ready_s = end_s[static_cast<std::size_t>(need)]; previous[i] < 0 || ready_s > begin_s)
        begin_s = ready_s, previous[i] = need;
    const KindKnowledge& known = kinds[static_cast<std::size_t>(items[i].kind)];
    const double alone_s = known.stats.num > 0 ? expected_law(known.stats).mean_s() : 0;
    end_s[i] = begin_s + std::max(0.0, alone_s - std::max(0.0, items[i].elapsed_s));
  }
  std::size_t last = 0;  // of equals the one behind: it may need the other
  for (std::size_t i = 0; i < items.size(); ++i)
    if (end_s[i] >= end_s[last]) last = i;
  CriticalPath path{.length_s = end_s[last]};
  for (int i = static_cast<int>(last); i >= 0; i = previous[static_cast<std::size_t>(i)])
    path.items.push_back(i);
  std::reverse(path.items.begin(), path.items.end());
  return path;
}

}  // namespace vantage
