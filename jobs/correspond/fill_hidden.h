#pragma once
#include <opencv2/core.hpp>

#include "jobs/correspond/flow_pair.h"

namespace vantage {

/// Round trips longer than this are taken for no match at all.
constexpr float kHiddenRoundTrip_px = 1;

/// Gives pixels whose motion does not come back, mostly because the other picture hides them, the affine motion of
/// consistent pixels that are nearest without crossing an edge of the picture. a and b: grey levels 0–255.
void fill_hidden(const cv::Mat1f& a, const cv::Mat1f& b, FlowPair& flow);

/// 1 where a motion comes back, else 0: what a data term can be trusted for.
cv::Mat1f comes_back(const cv::Mat2f& forward, const cv::Mat2f& backward);

}  // namespace vantage
