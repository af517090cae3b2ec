#pragma once
#include <opencv2/core.hpp>

#include "jobs/sync/motion_offset.h"

namespace vantage::sync {

/// The moment of a, with its matched points, at which most of them are seen, and b's frame nearest to it, side by side:
/// each matched point in one colour on both sides, with its path of the last moments. Empty without matched points.
cv::Mat matches_picture(const MotionInput& input, const MotionAnswer& answer);

/// How far points and outlines are from their epipolar lines at the answer, in pixels: a histogram of each, with the
/// noise found. Empty when neither was compared.
cv::Mat residuals_picture(const MotionInput& input, const MotionAnswer& answer);

}  // namespace vantage::sync
