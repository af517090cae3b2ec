#pragma once
#include <vector>

namespace vantage {

struct DepthVote {
  float inverse_depth, weight;  ///< weight > 0
};

/// What most of the weight says: the weighted mean of those within `agreement` (a share) of the weighted median.
struct Consensus {
  float inverse_depth = 0;
  float share = 0;  ///< of all weight, that agrees
  int num_agreeing = 0;
};

/// votes: one or more; sorted on return.
Consensus consensus_of(std::vector<DepthVote>& votes, float agreement);

}  // namespace vantage
