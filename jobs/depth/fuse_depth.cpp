#include "jobs/depth/fuse_depth.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace vantage {
namespace {

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

Fused fuse(std::vector<Vote>& votes, float agreement) {
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

}  // namespace

DepthMap fuse_depths(std::span<const EdgeDepth> edges, double agreement) {
  if (edges.empty()) return {};
  const cv::Size size = edges.front().inverse_depth.size();
  DepthMap depth{cv::Mat1f(size), cv::Mat1f(size)};
  std::vector<Vote> votes;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      votes.clear();
      for (const EdgeDepth& edge : edges)
        if (const float weight = edge.weight(y, x); weight > 0) votes.push_back({edge.inverse_depth(y, x), weight});
      const Fused fused = fuse(votes, static_cast<float>(agreement));
      depth.z(y, x) = fused.z;
      depth.confidence(y, x) = fused.confidence;
    }
  return depth;
}

}  // namespace vantage
