#pragma once
#include <opencv2/core.hpp>

namespace vantage {

/// Depth for every pixel: known ones (> 0) as they are, others smoothly from their surroundings, where far ones count
/// more: what no other camera saw lies behind something. fallback: where nothing at all is known.
cv::Mat1f filled_depth(const cv::Mat1f& z, double fallback);

}  // namespace vantage
