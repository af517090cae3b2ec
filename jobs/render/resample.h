#pragma once
#include <opencv2/core.hpp>

namespace vantage {

/// The picture at px (centres at +0.5): Catmull-Rom, beyond the rim the rim. Never outside what the 2 × 2 pixels around
/// px span by more than a tenth of their contrast: in linear light a cubic would draw dark seams beside lights.
cv::Vec3f resample(const cv::Mat3f& picture, const cv::Vec2f& px);

}  // namespace vantage
