#include "jobs/depth/fill_gaps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace vantage {
namespace {

/// Inverse depths up to this share above the farthest found are of its side.
constexpr float kOneSide = 0.1F;

/// 255 on connected spots of `mask` of at most max_area_px pixels.
cv::Mat1b small_spots(const cv::Mat1b& mask, double max_area_px) {
  cv::Mat1i labels, stats;
  cv::Mat centroids;
  cv::connectedComponentsWithStats(mask, labels, stats, centroids, 4);
  cv::Mat1b small(mask.size(), uchar{0});
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x)
      if (mask(y, x) && stats(labels(y, x), cv::CC_STAT_AREA) <= max_area_px) small(y, x) = 255;
  return small;
}

struct Found {
  float inverse_depth, per_px;
};

/// The nearest known pixel from `from` on, going by `step`.
Found look(const cv::Mat1f& inverse_depth, const cv::Mat1b& gaps, cv::Point from, cv::Point step) {
  const cv::Rect frame({}, inverse_depth.size());
  const auto length = static_cast<float>(std::hypot(step.x, step.y));
  float distance_px = 0;
  for (cv::Point at = from + step; frame.contains(at); at += step) {
    distance_px += length;
    if (inverse_depth(at) > 0) return {inverse_depth(at), 1 / distance_px};
    if (!gaps(at)) break;  // a large unknown area: nothing to be had from beyond it
  }
  return {0, 0};
}

float from_farther_side(const cv::Mat1f& inverse_depth, const cv::Mat1b& gaps, cv::Point at) {
  static constexpr std::array<std::array<int, 2>, 8> kSteps{
      {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
  std::array<Found, 8> found{};
  float farthest = 0;
  for (std::size_t k = 0; k < kSteps.size(); ++k) {
    found[k] = look(inverse_depth, gaps, at, {kSteps[k][0], kSteps[k][1]});
    if (found[k].per_px > 0 && (farthest <= 0 || found[k].inverse_depth < farthest)) farthest = found[k].inverse_depth;
  }
  float sum = 0, total = 0;
  for (const Found& f : found) {
    if (f.per_px <= 0 || f.inverse_depth > (1 + kOneSide) * farthest) continue;
    sum += f.per_px * f.inverse_depth;
    total += f.per_px;
  }
  return total > 0 ? sum / total : 0;
}

}  // namespace

void fill_gaps(cv::Mat1f& inverse_depth, cv::Mat1f& confidence, double max_gap_percent) {
  const double max_area_px = max_gap_percent / 100 * static_cast<double>(inverse_depth.total());
  const cv::Mat1b gaps = small_spots(cv::Mat1b(inverse_depth <= 0), max_area_px);
  const cv::Mat1f known = inverse_depth.clone();
  for (int y = 0; y < gaps.rows; ++y)
    for (int x = 0; x < gaps.cols; ++x) {
      if (!gaps(y, x)) continue;
      inverse_depth(y, x) = from_farther_side(known, gaps, {x, y});
      confidence(y, x) = inverse_depth(y, x) > 0 ? kFilledConfidence : 0;
    }
}

}  // namespace vantage
