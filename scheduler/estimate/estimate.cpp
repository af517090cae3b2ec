#include "scheduler/estimate/estimate.h"

#include <algorithm>
#include <cmath>

#include "scheduler/estimate/play.h"

namespace vantage {
namespace {

/// Enough for the 10 and 90 % marks; fewer where a run is long, so that the whole stays within about 30 ms.
constexpr std::size_t kMaxRuns = 200, kMinRuns = 40, kItemsPlayed = 160'000;

std::size_t number(int n) { return static_cast<std::size_t>(n); }

/// Waits for all items of earlier kinds and takes no time.
WorkItem gate(const std::vector<WorkItem>& items, std::size_t kind) {
  WorkItem gate{.kind = static_cast<int>(kind), .num_jobs = 0};
  for (std::size_t i = 0; i < items.size(); ++i)
    if (number(items[i].kind) < kind) gate.needs.push_back(static_cast<int>(i));
  return gate;
}

/// Jobs that are not planned yet, as items: the first kind of them waits for all that is planned before it in the
/// pipeline, each later kind follows the one before it in step.
void add_unplanned(const EstimateInput& input, std::vector<WorkItem>& items) {
  constexpr int kMaxItemsPerKind = 500;
  std::vector<int> before;  // items that the next kind follows
  for (std::size_t kind = 0; kind < input.kinds.size(); ++kind) {
    const KindKnowledge& known = input.kinds[kind];
    const int num = known.num_unplanned.value_or(0);
    if (num == 0 || known.stats.num == 0) continue;
    if (before.empty() && !items.empty()) {
      items.push_back(gate(items, kind));
      before = {static_cast<int>(items.size()) - 1};
    }
    const int num_items = std::min(num, kMaxItemsPerKind);
    std::vector<int> made;
    for (int i = 0; i < num_items; ++i) {
      WorkItem item{.kind = static_cast<int>(kind), .cores = known.cores};
      item.num_jobs = (i + 1) * num / num_items - i * num / num_items;
      if (!before.empty())
        item.needs = {before[std::min(before.size() - 1, before.size() * number(i + 1) / number(num_items))]};
      made.push_back(static_cast<int>(items.size()));
      items.push_back(std::move(item));
    }
    before = made;
  }
}

bool is_known(const EstimateInput& input, const WorkItem& item) { return input.kinds[number(item.kind)].stats.num > 0; }

std::vector<std::string> unknown_kinds(const EstimateInput& input) {
  std::vector<bool> unknown(input.kinds.size(), false);
  for (const WorkItem& item : input.items)
    if (!is_known(input, item)) unknown[number(item.kind)] = true;
  std::vector<std::string> names;
  for (std::size_t kind = 0; kind < input.kinds.size(); ++kind) {
    const KindKnowledge& known = input.kinds[kind];
    const bool unplanned = !known.num_unplanned || (*known.num_unplanned > 0 && known.stats.num == 0);
    if (unknown[kind] || unplanned) names.push_back(known.kind);
  }
  return names;
}

std::vector<double> draw_durations(const EstimateInput& input, const std::vector<WorkItem>& items,
                                   std::mt19937_64& random) {
  std::vector<DurationLaw> laws;
  for (const KindKnowledge& known : input.kinds)
    laws.push_back(known.stats.num > 0 ? draw_law(known.stats, known.other_shots, random) : DurationLaw{});
  std::vector<double> durations_s;
  durations_s.reserve(items.size());
  for (const WorkItem& item : items) {
    const DurationLaw& law = laws[number(item.kind)];
    durations_s.push_back(!is_known(input, item) ? 0
                          : item.elapsed_s >= 0  ? law.draw_rest_s(item.elapsed_s, random)
                                                 : law.draw_sum_s(item.num_jobs, random));
  }
  return durations_s;
}

double quantile(const std::vector<double>& sorted, double q) {
  const double at = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

}  // namespace

std::optional<Estimate> estimate_rest(const EstimateInput& input, std::uint64_t seed) {
  if (input.capacity.num_slots <= 0 || input.capacity.num_cores <= 0) return std::nullopt;
  Estimate estimate{.unknown_kinds = unknown_kinds(input)};
  std::vector<WorkItem> items = input.items;
  add_unplanned(input, items);
  if (items.empty()) return estimate.unknown_kinds.empty() ? std::optional(estimate) : std::nullopt;
  if (std::none_of(items.begin(), items.end(), [&](const WorkItem& item) { return is_known(input, item); }))
    return std::nullopt;
  const ItemGraph graph(items);
  const std::size_t num_runs = std::clamp(kItemsPlayed / items.size(), kMinRuns, kMaxRuns);
  std::vector<double> ends_s;
  std::mt19937_64 random(seed);
  for (std::size_t run = 0; run < num_runs; ++run)
    ends_s.push_back(play(items, graph, draw_durations(input, items, random), input.capacity));
  std::sort(ends_s.begin(), ends_s.end());
  estimate.low_s = quantile(ends_s, 0.1);
  estimate.middle_s = quantile(ends_s, 0.5);
  estimate.high_s = quantile(ends_s, 0.9);
  return estimate;
}

}  // namespace vantage
