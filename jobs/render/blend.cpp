#include "jobs/render/blend.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "jobs/render/push_pull.h"

namespace vantage {
namespace {

constexpr float kSameSurface = 0.05F;  ///< of depth
constexpr double kEnoughWeight = 0.1;  ///< of all layers' weight: a nearer surface that fewer see is an error of depth
constexpr float kKnownWithin_px = 8;   ///< small holes are filled and count as known

struct Candidate {
  float z;
  double weight;
  const cv::Vec3f* bgr;
};

/// [first, last) of the candidates, sorted by depth, that are the visible surface.
std::pair<std::size_t, std::size_t> visible_surface(const std::vector<Candidate>& sorted) {
  double all = 0;
  for (const Candidate& c : sorted) all += c.weight;
  std::size_t first = 0;
  while (true) {
    std::size_t last = first;
    double weight = 0;
    for (; last < sorted.size() && sorted[last].z <= sorted[first].z * (1 + kSameSurface); ++last)
      weight += sorted[last].weight;
    if (weight >= kEnoughWeight * all || last == sorted.size()) return {first, last};
    ++first;
  }
}

float cubic(float t) {  // Catmull-Rom
  t = std::abs(t);
  return t < 1 ? (1.5F * t - 2.5F) * t * t + 1 : t < 2 ? ((-0.5F * t + 2.5F) * t - 4) * t + 2 : 0;
}

cv::Vec3f sample(const cv::Mat3f& bgr, const cv::Vec2f& px) {
  const float fx = px[0] - 0.5F, fy = px[1] - 0.5F;
  const int x0 = static_cast<int>(std::floor(fx)), y0 = static_cast<int>(std::floor(fy));
  std::array<float, 4> wx{}, wy{};
  for (int k = 0; k < 4; ++k) {
    wx[static_cast<std::size_t>(k)] = cubic(fx - static_cast<float>(x0 + k - 1));
    wy[static_cast<std::size_t>(k)] = cubic(fy - static_cast<float>(y0 + k - 1));
  }
  cv::Vec3f sum(0, 0, 0);
  for (int v = 0; v < 4; ++v) {
    const cv::Vec3f* row = bgr[std::clamp(y0 + v - 1, 0, bgr.rows - 1)];
    cv::Vec3f line(0, 0, 0);
    for (int u = 0; u < 4; ++u) {
      const cv::Vec3f& p = row[std::clamp(x0 + u - 1, 0, bgr.cols - 1)];
      const float w = wx[static_cast<std::size_t>(u)];
      line += cv::Vec3f(w * p[0], w * p[1], w * p[2]);
    }
    sum += wy[static_cast<std::size_t>(v)] * line;
  }
  return sum;
}

/// Colours everywhere, alpha where a layer is near.
void fill_holes(ViewPicture& picture) {
  const cv::Mat hole = picture.alpha == 0;
  if (cv::countNonZero(hole) == 0) return;
  if (cv::countNonZero(hole) == picture.alpha.rows * picture.alpha.cols) return;
  push_pull<3>(picture.bgr, picture.alpha);
  cv::Mat1f distance;
  cv::distanceTransform(hole, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  picture.alpha.setTo(1, distance <= kKnownWithin_px);
}

}  // namespace

cv::Mat3f layer_colours(const cv::Mat3f& bgr, const Layer& layer) {
  cv::Mat3f colours(layer.z.size(), cv::Vec3f(0, 0, 0));
  for (int y = 0; y < colours.rows; ++y)
    for (int x = 0; x < colours.cols; ++x)
      if (layer.z(y, x) > 0) colours(y, x) = sample(bgr, layer.source_px(y, x));
  return colours;
}

ViewPicture blend(const std::vector<ColouredLayer>& layers) {
  const cv::Size size = layers.front().bgr.size();
  ViewPicture picture{cv::Mat3f(size, cv::Vec3f(0, 0, 0)), cv::Mat1f(size, 0.0F), cv::Mat1f(size, 0.0F)};
  std::vector<Candidate> candidates;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      candidates.clear();
      for (const ColouredLayer& l : layers)
        if (l.layer.z(y, x) > 0)
          candidates.push_back({l.layer.z(y, x), l.share * l.layer.confidence(y, x), &l.bgr(y, x)});
      if (candidates.empty()) continue;
      std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) { return a.z < b.z; });
      const auto [first, last] = visible_surface(candidates);
      cv::Vec3d sum(0, 0, 0);
      double z = 0, weight = 0;
      for (std::size_t k = first; k < last; ++k) {
        sum += candidates[k].weight * cv::Vec3d(*candidates[k].bgr);
        z += candidates[k].weight * candidates[k].z;
        weight += candidates[k].weight;
      }
      if (weight <= 0) continue;
      for (int c = 0; c < 3; ++c) picture.bgr(y, x)[c] = static_cast<float>(std::clamp(sum[c] / weight, 0.0, 1.0));
      picture.z(y, x) = static_cast<float>(z / weight);
      picture.alpha(y, x) = 1;
    }
  fill_holes(picture);
  return picture;
}

}  // namespace vantage
