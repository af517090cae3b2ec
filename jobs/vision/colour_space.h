#pragma once
/// sRGB as filmed and shown (IEC 61966-2-1), and linear light, in which pictures are blended and resampled.
#include <opencv2/core.hpp>

#include "schema/formats/colour.h"

namespace vantage {

/// Exact, clamped to 0–1.
float linear_from_srgb(float value);
float srgb_from_linear(float value);

/// Linear light, 0–1, of a BGR picture of 8-bit or 16-bit sRGB levels.
cv::Mat3f linear_from_srgb(const cv::Mat& levels);
/// The same in the look that all cameras share: not rounded to levels on the way.
cv::Mat3f linear_from_srgb(const cv::Mat& levels, const CameraColour& look);

/// Nearest sRGB level of each value, clamped. By a table that is off by less than 0.001 of an 8-bit level, 0.25 of a
/// 16-bit one.
cv::Mat3b srgb8_from_linear(const cv::Mat3f& linear);
cv::Mat3w srgb16_from_linear(const cv::Mat3f& linear);

}  // namespace vantage
