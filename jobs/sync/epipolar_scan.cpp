#include "jobs/sync/epipolar_scan.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "schema/base/median.h"

namespace vantage::sync {
namespace {

constexpr double kMinOverlapS = 2;
constexpr double kMinOverlapShare = 0.4;
constexpr std::size_t kMaxSamplesPerTrack = 40;

double duration_s(const FrameTable& table) { return table.pts_s.empty() ? 0 : table.pts_s.back(); }

double score_match(const TimedTrack& a, const TimedTrack& b, const PairGeometry& geometry, double offset_s,
                   double max_px) {
  const std::size_t stride = (a.size() + kMaxSamplesPerTrack - 1) / kMaxSamplesPerTrack;
  double score = 0;
  for (std::size_t k = 0; k < a.size(); k += stride) {
    const double time_b = a.time_s(k) - offset_s;
    const auto px_b = b.at(time_b);
    if (!px_b) continue;
    const auto residual = geometry.residual_px(a.px(k), a.time_s(k), *px_b, time_b);
    if (residual) score += std::max(0.0, 1 - (*residual * *residual) / (max_px * max_px));
  }
  return score;
}

}  // namespace

int OffsetRange::num() const {
  return max_s < min_s ? 0 : 1 + static_cast<int>(std::floor((max_s - min_s) / step_s + 1e-9));
}

double OffsetRange::overlap_s(double offset_s) const {
  return std::min(duration_a_s, duration_b_s + offset_s) - std::max(0.0, offset_s);
}

void OffsetScan::find_modes() {
  modes.clear();
  if (scores.empty()) return;
  const double highest = *std::max_element(scores.begin(), scores.end());
  if (highest <= 0) return;
  const double drop = 0.1 * highest;
  double valley = -std::numeric_limits<double>::infinity(), peak = -std::numeric_limits<double>::infinity();
  std::size_t at = 0;
  bool rising = true;
  for (std::size_t k = 0; k < scores.size(); ++k) {
    if (rising && scores[k] > peak) peak = scores[k], at = k;
    if (rising && (scores[k] < peak - drop || k + 1 == scores.size())) {
      modes.push_back({range.at(static_cast<int>(at)), peak});
      rising = false;
      valley = scores[k];
    }
    if (!rising) valley = std::min(valley, scores[k]);
    if (!rising && scores[k] > valley + drop) rising = true, peak = scores[k], at = k;
  }
  std::stable_sort(modes.begin(), modes.end(), [](auto& p, auto& q) { return p.score > q.score; });
}

double OffsetScan::contrast() const {
  if (modes.empty()) return 0;
  const double overlap = range.overlap_s(modes[0].offset_s);
  double next = 0;
  for (std::size_t k = 1; k < modes.size(); ++k)
    if (const double other = range.overlap_s(modes[k].offset_s); other >= 0.5 * overlap)
      next = std::max(next, modes[k].score / other);
  return next > 0 ? modes[0].score / overlap / next : std::numeric_limits<double>::infinity();
}

OffsetRange plausible_offsets(const FrameTable& a, const FrameTable& b, double max_offset_s) {
  const double overlap = std::min(kMinOverlapS, kMinOverlapShare * std::min(duration_s(a), duration_s(b)));
  OffsetRange range{.duration_a_s = duration_s(a), .duration_b_s = duration_s(b)};
  range.step_s = 0.5 * std::min(frame_interval_s(a), frame_interval_s(b));
  range.min_s = std::max(-max_offset_s, overlap - duration_s(b));
  range.max_s = std::min(max_offset_s, duration_s(a) - overlap);
  return range;
}

OffsetScan scan_offsets(const std::vector<TimedTrack>& a, const std::vector<TimedTrack>& b,
                        const std::vector<TrackMatch>& matches, const PairGeometry& geometry, const OffsetRange& range,
                        double max_epipolar_px) {
  const auto num = static_cast<std::size_t>(range.num());
  OffsetScan scan{range, std::vector<double>(num, 0), {}};
  if (num == 0) return scan;
  for (std::size_t m = 0; m < matches.size();) {
    const std::size_t track = matches[m].a;
    std::vector<double> best(num, 0);
    for (; m < matches.size() && matches[m].a == track; ++m)
      for (std::size_t k = 0; k < num; ++k)
        best[k] = std::max(
            best[k], score_match(a[track], b[matches[m].b], geometry, range.at(static_cast<int>(k)), max_epipolar_px));
    const double base = median(best);
    for (std::size_t k = 0; k < num; ++k) scan.scores[k] += std::max(0.0, best[k] - base);
  }
  scan.find_modes();
  return scan;
}

}  // namespace vantage::sync
