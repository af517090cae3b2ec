#include "jobs/depth/votes.h"

#include <algorithm>
#include <cmath>

namespace vantage {
namespace {

float weighted_median(const std::vector<DepthVote>& sorted, float total) {
  float sum = 0;
  for (const DepthVote& vote : sorted) {
    sum += vote.weight;
    if (2 * sum >= total) return vote.inverse_depth;
  }
  return sorted.back().inverse_depth;
}

}  // namespace

Consensus consensus_of(std::vector<DepthVote>& votes, float agreement) {
  std::sort(votes.begin(), votes.end(),
            [](const DepthVote& a, const DepthVote& b) { return a.inverse_depth < b.inverse_depth; });
  float total = 0, agreeing = 0, sum = 0;
  for (const DepthVote& vote : votes) total += vote.weight;
  const float middle = weighted_median(votes, total);
  int num_agreeing = 0;
  for (const DepthVote& vote : votes) {
    if (std::abs(vote.inverse_depth - middle) > agreement * middle) continue;
    agreeing += vote.weight;
    sum += vote.weight * vote.inverse_depth;
    ++num_agreeing;
  }
  return {sum / agreeing, agreeing / total, num_agreeing};
}

}  // namespace vantage
