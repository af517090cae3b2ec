#include "jobs/depth/fuse_depth.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/ximgproc/edge_filter.hpp>
#include <vector>

namespace vantage {
namespace {

/// Filled spots and lone votes are worth using, but not trusting.
constexpr float kFilledConfidence = 0.1F;
/// Fast global smoother (Min et al. 2014): strength, and grey levels that count as an edge. Weak: the maps are good
/// already, it only takes out the noise of single pixels.
constexpr double kSmoothLambda = 4;
constexpr double kSmoothSigma = 8;
/// Strong, to carry depth over a gap.
constexpr double kFillLambda = 500;

struct Vote {
  float inverse_depth, weight;
};

float weighted_median(std::vector<Vote>& votes) {
  std::sort(votes.begin(), votes.end(), [](const Vote& a, const Vote& b) { return a.inverse_depth < b.inverse_depth; });
  float total = 0, sum = 0;
  for (const Vote& vote : votes) total += vote.weight;
  for (const Vote& vote : votes) {
    sum += vote.weight;
    if (2 * sum >= total) return vote.inverse_depth;
  }
  return votes.back().inverse_depth;
}

struct Fused {
  float z = 0, confidence = 0;
};

Fused fuse(std::vector<Vote>& votes, double agreement) {
  if (votes.empty()) return {};
  const float middle = weighted_median(votes);
  float total = 0, agreeing = 0, sum = 0;
  int num_agreeing = 0;
  for (const Vote& vote : votes) {
    total += vote.weight;
    if (std::abs(vote.inverse_depth - middle) > agreement * middle) continue;
    agreeing += vote.weight;
    sum += vote.weight * vote.inverse_depth;
    ++num_agreeing;
  }
  const float share = agreeing / total;
  return {agreeing / sum, num_agreeing >= 2 ? share : std::min(share, kLoneConfidence)};
}

cv::Mat1f smoothed(const cv::Mat& guide, const cv::Mat& values, double lambda) {
  cv::Mat1f out;
  cv::ximgproc::fastGlobalSmootherFilter(guide, values, out, lambda, kSmoothSigma);
  return out;
}

/// Inverse depth of known pixels spread over the picture, weighted by confidence.
cv::Mat1f spread(const cv::Mat1f& inverse_depth, const cv::Mat1f& weight, const cv::Mat& guide, double lambda) {
  const cv::Mat weighted = inverse_depth.mul(weight);
  const cv::Mat1f sum = smoothed(guide, weighted, lambda), weights = smoothed(guide, weight, lambda);
  cv::Mat1f mean(sum.size(), 0.0F);
  for (int y = 0; y < mean.rows; ++y)
    for (int x = 0; x < mean.cols; ++x)
      if (weights(y, x) > 1e-6F) mean(y, x) = sum(y, x) / weights(y, x);
  return mean;
}

/// 255 on connected spots of `mask` of at most max_area_px pixels.
cv::Mat1b small_spots(const cv::Mat1b& mask, int max_area_px) {
  cv::Mat labels, stats, centroids;
  const int count = cv::connectedComponentsWithStats(mask, labels, stats, centroids, 4);
  cv::Mat1b small(mask.size(), uchar{0});
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) {
      const int label = labels.at<int>(y, x);
      if (label > 0 && label < count && stats.at<int>(label, cv::CC_STAT_AREA) <= max_area_px) small(y, x) = 255;
    }
  return small;
}

cv::Mat1f inverse_of(const cv::Mat1f& z) {
  cv::Mat1f inverse(z.size(), 0.0F);
  for (int y = 0; y < z.rows; ++y)
    for (int x = 0; x < z.cols; ++x)
      if (z(y, x) > 0) inverse(y, x) = 1 / z(y, x);
  return inverse;
}

/// Pixels that fewer than 2 of the 8 around them agree with become unknown.
void drop_specks(cv::Mat1f& inverse_depth, cv::Mat1f& confidence, double agreement) {
  const cv::Mat1f before = inverse_depth.clone();
  for (int y = 0; y < before.rows; ++y)
    for (int x = 0; x < before.cols; ++x) {
      const float value = before(y, x);
      int agreeing = -1;  // the pixel itself
      for (int v = std::max(0, y - 1); v <= std::min(before.rows - 1, y + 1); ++v)
        for (int u = std::max(0, x - 1); u <= std::min(before.cols - 1, x + 1); ++u)
          agreeing += std::abs(before(v, u) - value) <= 3 * agreement * value;
      if (value > 0 && agreeing < 2) inverse_depth(y, x) = confidence(y, x) = 0;
    }
}

}  // namespace

DepthMap fuse_depths(std::span<const EdgeDepth> edges, const FuseDepthOptions& options) {
  if (edges.empty()) return {};
  const cv::Size size = edges.front().inverse_depth.size();
  DepthMap depth{cv::Mat1f(size, 0.0F), cv::Mat1f(size, 0.0F)};
  std::vector<Vote> votes;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      votes.clear();
      for (const EdgeDepth& edge : edges)
        if (const float strength = edge.strength(y, x); strength > 0)
          votes.push_back({edge.inverse_depth(y, x), strength * strength});
      const Fused fused = fuse(votes, options.agreement);
      depth.z(y, x) = fused.z;
      depth.confidence(y, x) = fused.confidence;
    }
  return depth;
}

DepthMap regularise(const DepthMap& depth, const cv::Mat& guide, const FuseDepthOptions& options) {
  cv::Mat1f inverse = inverse_of(depth.z);
  DepthMap out{cv::Mat1f(depth.z.size(), 0.0F), depth.confidence.clone()};
  drop_specks(inverse, out.confidence, options.agreement);
  const cv::Mat1f smooth = spread(inverse, out.confidence, guide, kSmoothLambda);
  const cv::Mat1f wide = spread(inverse, out.confidence, guide, kFillLambda);
  const cv::Mat1b fill = small_spots(cv::Mat1b(inverse <= 0), options.max_gap_px);
  for (int y = 0; y < inverse.rows; ++y)
    for (int x = 0; x < inverse.cols; ++x) {
      const float value = inverse(y, x);
      // Where smoothing would pull a pixel off its surface, an edge of depth has none in the picture: leave it.
      if (value > 0)
        out.z(y, x) = 1 / (std::abs(smooth(y, x) - value) <= options.agreement * value ? smooth(y, x) : value);
      else if (fill(y, x) && wide(y, x) > 0) {
        out.z(y, x) = 1 / wide(y, x);
        out.confidence(y, x) = kFilledConfidence;
      }
    }
  return out;
}

}  // namespace vantage
