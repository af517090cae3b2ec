#include "jobs/depth/regularise.h"

#include <algorithm>
#include <cmath>

#include "jobs/depth/colour_weight.h"
#include "jobs/depth/fill_gaps.h"
#include "jobs/depth/outlines.h"

namespace vantage {
namespace {

constexpr int kSmoothRadius_px = 2;
constexpr double kSmoothSigma_px = 1.5;
constexpr double kSmoothSigmaColour = 12;  ///< 8-bit levels: above a sensor's noise, below most edges
/// Noise of a surface is well below what still counts as agreement of two edges.
constexpr double kSurfaceShare = 0.4;

cv::Mat1f inverse_of(const cv::Mat1f& values) {
  cv::Mat1f inverse(values.size());
  std::transform(values.begin(), values.end(), inverse.begin(), [](float v) { return v > 0 ? 1 / v : 0.0F; });
  return inverse;
}

/// Pixels that fewer than 2 of the 8 around them agree with become unknown.
void drop_specks(cv::Mat1f& inverse_depth, cv::Mat1f& confidence, double agreement) {
  const cv::Mat1f before = inverse_depth.clone();
  const auto slack = static_cast<float>(3 * agreement);
  for (int y = 0; y < before.rows; ++y)
    for (int x = 0; x < before.cols; ++x) {
      const float value = before(y, x);
      int agreeing = -1;  // the pixel itself
      for (int v = std::max(0, y - 1); v <= std::min(before.rows - 1, y + 1); ++v)
        for (int u = std::max(0, x - 1); u <= std::min(before.cols - 1, x + 1); ++u)
          agreeing += std::abs(before(v, u) - value) <= slack * value;
      if (value > 0 && agreeing < 2) inverse_depth(y, x) = confidence(y, x) = 0;
    }
}

cv::Mat1f spatial_weights(int radius_px, double sigma_px) {
  cv::Mat1f weights(2 * radius_px + 1, 2 * radius_px + 1);
  for (int v = -radius_px; v <= radius_px; ++v)
    for (int u = -radius_px; u <= radius_px; ++u)
      weights(v + radius_px, u + radius_px) =
          static_cast<float>(std::exp(-(u * u + v * v) / (2 * sigma_px * sigma_px)));
  return weights;
}

}  // namespace

cv::Mat1f smooth_surfaces(const cv::Mat1f& inverse_depth, const cv::Mat1f& confidence, const cv::Mat3b& guide,
                          double agreement) {
  const ColourWeight alike(kSmoothSigmaColour);
  const cv::Mat1f near = spatial_weights(kSmoothRadius_px, kSmoothSigma_px);
  const int rows = inverse_depth.rows, cols = inverse_depth.cols, r = kSmoothRadius_px;
  cv::Mat1f out = inverse_depth.clone();
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < cols; ++x) {
      const float value = inverse_depth(y, x);
      if (value <= 0) continue;
      const float per_range = 1 / (static_cast<float>(agreement) * value);
      float sum = 0, total = 0;
      for (int v = std::max(0, y - r); v <= std::min(rows - 1, y + r); ++v)
        for (int u = std::max(0, x - r); u <= std::min(cols - 1, x + r); ++u) {
          const float off = (inverse_depth(v, u) - value) * per_range;
          if (std::abs(off) >= 1) continue;  // unknown ones, too
          const float weight =
              (1 - off * off) * confidence(v, u) * near(v - y + r, u - x + r) * alike(guide(v, u), guide(y, x));
          sum += weight * inverse_depth(v, u);
          total += weight;
        }
      if (total > 0) out(y, x) = sum / total;
    }
  return out;
}

DepthMap regularise(const DepthMap& depth, const cv::Mat3b& guide, const RegulariseOptions& options) {
  cv::Mat1f inverse = inverse_of(depth.z), confidence = depth.confidence.clone();
  drop_specks(inverse, confidence, options.agreement);
  inverse = smooth_surfaces(inverse, confidence, guide, kSurfaceShare * options.agreement);
  align_outlines(inverse, confidence, guide);
  fill_gaps(inverse, confidence, options.max_gap_percent);
  return {inverse_of(inverse), confidence};
}

}  // namespace vantage
