#pragma once
/// Which of two motions a pixel has: the one that a model predicts (static scene, or no motion at all) or the one that
/// an unconstrained search found, e.g. on things that moved between two exposures.
#include <opencv2/core.hpp>

#include "jobs/correspond/flow_pair.h"

namespace vantage {

struct FuseOptions {
  /// Census bits (of 62) that the searched motion must match better by, where both are consistent both ways.
  float preference_bits = 2;
  /// Round trips up to this long are consistent.
  float consistent_px = 1.5F;
};

/// Per pixel, both ways. Neighbours with like grey values decide alike (guided filter over the costs, He et al. 2013).
FlowPair fuse_flows(const cv::Mat1b& a, const cv::Mat1b& b, const FlowPair& predicted, const FlowPair& searched,
                    const FuseOptions& options);

}  // namespace vantage
