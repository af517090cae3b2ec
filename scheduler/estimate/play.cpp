#include "scheduler/estimate/play.h"

#include <algorithm>
#include <functional>
#include <queue>
#include <utility>

namespace vantage {

ItemGraph::ItemGraph(std::span<const WorkItem> items) : first_dependent(items.size() + 1, 0) {
  for (const WorkItem& item : items) {
    num_needs.push_back(static_cast<int>(item.needs.size()));
    for (const int need : item.needs) ++first_dependent[static_cast<std::size_t>(need) + 1];
  }
  for (std::size_t i = 1; i < first_dependent.size(); ++i) first_dependent[i] += first_dependent[i - 1];
  dependents.resize(static_cast<std::size_t>(first_dependent.back()));
  std::vector<int> next(first_dependent.begin(), first_dependent.end() - 1);
  for (std::size_t i = 0; i < items.size(); ++i)
    for (const int need : items[i].needs)
      dependents[static_cast<std::size_t>(next[static_cast<std::size_t>(need)]++)] = static_cast<int>(i);
}

double play(std::span<const WorkItem> items, const ItemGraph& graph, std::span<const double> durations_s,
            const Capacity& capacity) {
  using Ready = std::pair<int, int>;   // kind, -index: the largest first
  using End = std::pair<double, int>;  // the earliest first
  std::priority_queue<Ready> ready;
  std::priority_queue<End, std::vector<End>, std::greater<>> running;
  std::vector<int> num_open = graph.num_needs;
  int free_slots = capacity.num_slots, free_cores = capacity.num_cores;
  double now_s = 0;
  const auto cores_of = [&](int i) { return std::min(items[static_cast<std::size_t>(i)].cores, capacity.num_cores); };
  const auto start = [&](int i) {
    --free_slots, free_cores -= cores_of(i);
    running.emplace(now_s + durations_s[static_cast<std::size_t>(i)], i);
  };
  for (int i = 0; i < static_cast<int>(items.size()); ++i) {
    const WorkItem& item = items[static_cast<std::size_t>(i)];
    if (item.elapsed_s >= 0)
      start(i);
    else if (item.needs.empty())
      ready.emplace(item.kind, -i);
  }
  while (true) {
    while (!ready.empty() && free_slots > 0 && cores_of(-ready.top().second) <= free_cores) {
      start(-ready.top().second);
      ready.pop();
    }
    if (running.empty()) return now_s;
    const auto [end_s, ended] = running.top();
    running.pop();
    now_s = end_s;
    ++free_slots, free_cores += cores_of(ended);
    const auto at = static_cast<std::size_t>(ended);
    for (int d = graph.first_dependent[at]; d < graph.first_dependent[at + 1]; ++d) {
      const int dependent = graph.dependents[static_cast<std::size_t>(d)];
      if (--num_open[static_cast<std::size_t>(dependent)] == 0)
        ready.emplace(items[static_cast<std::size_t>(dependent)].kind, -dependent);
    }
  }
}

}  // namespace vantage
