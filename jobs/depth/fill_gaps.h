#pragma once
#include <opencv2/core.hpp>

namespace vantage {

/// Fills connected unknown spots (inverse depth 0) of at most max_gap_percent of the picture: from the nearest known
/// pixels in eight directions, those of the farther side only, nearer ones counting more. Confidence:
/// kFilledConfidence.
constexpr float kFilledConfidence = 0.1F;
void fill_gaps(cv::Mat1f& inverse_depth, cv::Mat1f& confidence, double max_gap_percent);

}  // namespace vantage
