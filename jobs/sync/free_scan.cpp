#include "jobs/sync/free_scan.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "schema/base/median.h"

namespace vantage::sync {
namespace {

constexpr std::size_t kMaxSamples = 800;
constexpr double kMaxPx = 6;
constexpr int kDraws = 30;
constexpr int kMaxOffsets = 1200;
constexpr std::size_t kMaxModes = 6;
/// A mode is worth a look when it has so much of the best one's score.
constexpr double kMinModeShare = 0.3;

struct Sample {
  std::size_t pair = 0;
  double time_a_s = 0;
  Eigen::Vector2d a;
};

/// Samples of a that b may see at some offset of the range, thinned evenly.
std::vector<Sample> spread_samples(const std::vector<PathPair>& pairs, const OffsetRange& range) {
  std::vector<Sample> all, few;
  for (std::size_t p = 0; p < pairs.size(); ++p)
    for (std::size_t k = 0; k < pairs[p].a.size(); ++k)
      if (may_be_seen(pairs[p], pairs[p].a.time_s(k), range.min_s, range.max_s))
        all.push_back({p, pairs[p].a.time_s(k), pairs[p].a.px(k)});
  const std::size_t stride = std::max<std::size_t>(1, all.size() / kMaxSamples);
  for (std::size_t k = 0; k < all.size(); k += stride) few.push_back(all[k]);
  return few;
}

double median_speed_px_per_s(const std::vector<PathPair>& pairs, const std::vector<Sample>& samples) {
  std::vector<double> speeds;
  for (const Sample& s : samples) speeds.push_back(pairs[s.pair].a.velocity_at(s.time_a_s).px_per_s.norm());
  return speeds.empty() ? 0 : median(std::move(speeds));
}

OffsetRange with_step_for(OffsetRange range, double speed_px_per_s) {
  const double wide_s = kMaxPx / std::max(speed_px_per_s, 1.0);
  const double least_s = std::max(range.step_s, (range.max_s - range.min_s) / kMaxOffsets);
  range.step_s = std::clamp(wide_s, least_s, std::max(least_s, 0.25));
  return range;
}

/// One offset: cost of each sample (negative where b does not see it) under the geometry found there.
struct Column {
  std::vector<float> costs;
  std::optional<RobustFundamental> found;
};

Column try_offset(const std::vector<PathPair>& pairs, const std::vector<Sample>& samples,
                  const std::vector<PointMatch>& still, double offset_s, const std::vector<Eigen::Matrix3d>& starts) {
  std::vector<PointMatch> matches;
  std::vector<std::size_t> present;
  for (std::size_t k = 0; k < samples.size(); ++k)
    if (const auto b = pairs[samples[k].pair].b.at(samples[k].time_a_s - offset_s)) {
      matches.push_back({samples[k].a, *b});
      present.push_back(k);
    }
  Column column{std::vector<float>(samples.size(), -1), {}};
  if (present.empty()) return column;
  const std::size_t num_moving = matches.size();
  matches.insert(matches.end(), still.begin(), still.end());
  std::mt19937 random(8);
  column.found = robust_fundamental(matches, kMaxPx, kDraws, starts, random);
  if (!column.found) return column;
  for (std::size_t k = 0; k < num_moving; ++k)
    column.costs[present[k]] = static_cast<float>(truncated_cost({&matches[k], 1}, column.found->F, kMaxPx));
  return column;
}

/// Median of each sample's cost over the offsets at which b sees it.
std::vector<double> usual_costs(const std::vector<Column>& columns, std::size_t num_samples) {
  std::vector<double> usual(num_samples, 0), costs;
  for (std::size_t k = 0; k < num_samples; ++k) {
    costs.clear();
    for (const Column& column : columns)
      if (column.costs[k] >= 0) costs.push_back(double{column.costs[k]});
    if (!costs.empty()) usual[k] = median(costs);
  }
  return usual;
}

std::vector<FreeMode> find_modes(const OffsetScan& curve, const std::vector<Column>& columns) {
  std::vector<FreeMode> modes;
  const auto score = [&](std::size_t k) { return curve.scores[k]; };
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const bool highest = (k == 0 || score(k) > score(k - 1)) && (k + 1 == columns.size() || score(k) >= score(k + 1));
    if (highest && score(k) > 0 && columns[k].found)
      modes.push_back({curve.range.at(static_cast<int>(k)), score(k), columns[k].found->F});
  }
  std::stable_sort(modes.begin(), modes.end(), [](auto& p, auto& q) { return p.score > q.score; });
  while (modes.size() > kMaxModes || (!modes.empty() && modes.back().score < kMinModeShare * modes.front().score))
    modes.pop_back();
  return modes;
}

}  // namespace

bool may_be_seen(const PathPair& pair, double time_a_s, double min_s, double max_s) {
  return time_a_s - max_s <= pair.b.end_s() && time_a_s - min_s >= pair.b.begin_s();
}

FreeScan scan_free(const std::vector<PathPair>& pairs, const std::vector<PointMatch>& still, const OffsetRange& range) {
  const std::vector<Sample> samples = spread_samples(pairs, range);
  FreeScan scan{.curve = {}, .max_px = kMaxPx, .modes = {}};
  scan.curve.range = with_step_for(range, median_speed_px_per_s(pairs, samples));
  std::vector<Column> columns;
  std::vector<Eigen::Matrix3d> starts;  // the neighbour's geometry: once found, the true one is not lost again
  for (int k = 0; k < scan.curve.range.num(); ++k) {
    columns.push_back(try_offset(pairs, samples, still, scan.curve.range.at(k), starts));
    starts.clear();
    if (columns.back().found) starts.push_back(columns.back().found->F);
  }
  const std::vector<double> usual = usual_costs(columns, samples.size());
  for (const Column& column : columns) {
    double score = 0;
    for (std::size_t k = 0; k < samples.size(); ++k)
      if (column.costs[k] >= 0) score += usual[k] - double{column.costs[k]};
    scan.curve.scores.push_back(score);
  }
  scan.modes = find_modes(scan.curve, columns);
  for (const FreeMode& mode : scan.modes) scan.curve.modes.push_back({mode.offset_s, mode.score});
  return scan;
}

}  // namespace vantage::sync
