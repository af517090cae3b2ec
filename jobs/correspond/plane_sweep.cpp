#include "jobs/correspond/plane_sweep.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "jobs/correspond/census.h"
#include "jobs/correspond/semi_global.h"
#include "jobs/correspond/vector_clones.h"

namespace vantage {
namespace {

/// Cost of a hypothesis that leads out of picture b: worse than a match (about 10 bits differ), better than chance
/// (31).
constexpr std::uint8_t kOutsideCost = 20;

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

/// Where the line  n + w e  of one pixel goes, as element indices of picture b.
struct LineBuffers {
  std::vector<std::int32_t> x, y;
};

VANTAGE_VECTOR_CLONES void trace_line(const float* n, const float* e, float first, float step, int count,
                                      std::int32_t* xs, std::int32_t* ys) {
  for (int k = 0; k < count; ++k) {
    const float w = first + step * static_cast<float>(k);
    const float z = n[2] + w * e[2];
    // Behind b, or so far off that an int cannot hold it: element -1 is outside.
    const float scale = z > 1e-6F ? 1 / z : 0;
    const float px = std::min(std::max((n[0] + w * e[0]) * scale, -1.0F), 1e6F);
    const float py = std::min(std::max((n[1] + w * e[1]) * scale, -1.0F), 1e6F);
    xs[k] = z > 1e-6F ? static_cast<std::int32_t>(px + 1) - 1 : -1;
    ys[k] = static_cast<std::int32_t>(py + 1) - 1;
  }
}

VANTAGE_VECTOR_CLONES void cost_line(std::uint64_t centre, const Census& b, const std::int32_t* xs,
                                     const std::int32_t* ys, int count, std::uint8_t* costs) {
  for (int k = 0; k < count; ++k) {
    const bool inside = static_cast<unsigned>(xs[k]) < static_cast<unsigned>(b.width) &&
                        static_cast<unsigned>(ys[k]) < static_cast<unsigned>(b.height);
    costs[k] = inside ? static_cast<std::uint8_t>(std::popcount(centre ^ b.row(ys[k])[xs[k]])) : kOutsideCost;
  }
}

CostVolume matching_costs(const cv::Mat1b& grey_a, const cv::Mat1b& grey_b, const TwoView& views, const Sweep& sweep) {
  const Census a = census_transform(grey_a), b = census_transform(grey_b);
  CostVolume volume(grey_a.size(), sweep.count);
  LineBuffers line{std::vector<std::int32_t>(static_cast<std::size_t>(sweep.count)),
                   std::vector<std::int32_t>(static_cast<std::size_t>(sweep.count))};
  const Eigen::Vector3f ef = views.e.cast<float>();
  for (int y = 0; y < grey_a.rows; ++y)
    for (int x = 0; x < grey_a.cols; ++x) {
      const Eigen::Vector3f n = views.homogeneous({x + 0.5, y + 0.5}, 0).cast<float>();
      trace_line(n.data(), ef.data(), static_cast<float>(sweep.first), static_cast<float>(sweep.step), sweep.count,
                 line.x.data(), line.y.data());
      cost_line(a.row(y)[x], b, line.x.data(), line.y.data(), sweep.count, volume.at(x, y));
    }
  return volume;
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
  const double centre_px = views.px_per_inverse_depth({size.width / 2.0, size.height / 2.0}, 0);
  if (centre_px <= 1e-9) return {};
  return sweep_between(views, size, 0, size.width / centre_px, max_count);
}

cv::Mat1f sweep_inverse_depth(const cv::Mat1b& grey_a, const cv::Mat1b& grey_b, const TwoView& views,
                              const Sweep& sweep) {
  const cv::Mat1f best = semi_global_labels(matching_costs(grey_a, grey_b, views, sweep), grey_a);
  return cv::Mat1f(best * sweep.step + sweep.first);
}

}  // namespace vantage
