#include "jobs/correspond/plane_sweep.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "jobs/correspond/matching_costs.h"
#include "jobs/correspond/semi_global.h"

namespace vantage {
namespace {

/// Largest px_per_inverse_depth over a grid of pixels and a few inverse depths.
double fastest_px(const TwoView& views, cv::Size size, double first, double last) {
  double fastest = 0;
  for (int gy = 0; gy <= 4; ++gy)
    for (int gx = 0; gx <= 4; ++gx)
      for (int k = 0; k <= 2; ++k)
        fastest = std::max(fastest, views.px_per_inverse_depth({size.width * gx / 4.0, size.height * gy / 4.0},
                                                               first + (last - first) * k / 2));
  return fastest;
}

/// Inverse depths at which a pixel is seen within b, up to where it has crossed as much as b's width. Empty when it
/// never is.
std::optional<std::pair<double, double>> range_in_picture(const TwoView& views, cv::Size size,
                                                          const Eigen::Vector2d& px) {
  constexpr int kStepsPerWidth = 100, kLongestWidths = 8;
  std::optional<std::pair<double, double>> range;
  double w = 0;
  int inside = 0;
  for (int k = 0; k < kLongestWidths * kStepsPerWidth && inside < kStepsPerWidth; ++k) {
    const auto end = views.project(px, w);
    const double speed_px = views.px_per_inverse_depth(px, w);
    if (!end || speed_px <= 1e-9) break;
    if (end->x() >= 0 && end->y() >= 0 && end->x() < size.width && end->y() < size.height) {
      range = {range ? range->first : w, w};
      ++inside;
    } else if (range) {
      break;
    }
    w += size.width / (kStepsPerWidth * speed_px);
  }
  return range;
}

}  // namespace

Sweep sweep_between(const TwoView& views, cv::Size size, double first, double last, int max_count) {
  const double fastest = fastest_px(views, size, first, last);
  if (fastest <= 0 || last <= first) return {};
  const double wanted = std::ceil((last - first) * fastest) + 1;
  const int count = static_cast<int>(std::clamp(wanted, 4.0, static_cast<double>(max_count)));
  return {first, (last - first) / (count - 1), count};
}

Sweep widest_sweep(const TwoView& views, cv::Size size, int max_count) {
  double first = 1e30, last = 0;
  for (int gy = 0; gy <= 6; ++gy)
    for (int gx = 0; gx <= 6; ++gx)
      if (const auto range = range_in_picture(views, size, {size.width * gx / 6.0, size.height * gy / 6.0})) {
        first = std::min(first, range->first);
        last = std::max(last, range->second);
      }
  return last > first ? sweep_between(views, size, first, last, max_count) : Sweep{};
}

cv::Mat1f sweep_inverse_depth(const PosedPicture& a, const PosedPicture& b, const Sweep& sweep) {
  const cv::Mat1f best = semi_global_labels(matching_costs(a, b, sweep), a.grey);
  return cv::Mat1f(best * sweep.step + sweep.first);
}

}  // namespace vantage
