#include "jobs/depth/fuse_depth.h"

#include <algorithm>
#include <vector>

#include "jobs/depth/votes.h"

namespace vantage {

DepthMap fuse_depths(std::span<const EdgeDepth> edges, double agreement) {
  if (edges.empty()) return {};
  const cv::Size size = edges.front().inverse_depth.size();
  DepthMap depth{cv::Mat1f(size, 0.0F), cv::Mat1f(size, 0.0F)};
  std::vector<DepthVote> votes;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      votes.clear();
      for (const EdgeDepth& edge : edges)
        if (const float weight = edge.weight(y, x); weight > 0) votes.push_back({edge.inverse_depth(y, x), weight});
      if (votes.empty()) continue;
      const Consensus consensus = consensus_of(votes, static_cast<float>(agreement));
      depth.z(y, x) = 1 / consensus.inverse_depth;
      depth.confidence(y, x) =
          consensus.num_agreeing >= 2 ? consensus.share : std::min(consensus.share, kLoneConfidence);
    }
  return depth;
}

}  // namespace vantage
