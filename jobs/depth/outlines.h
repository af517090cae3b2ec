#pragma once
#include <opencv2/core.hpp>

namespace vantage {

/// Matching windows that straddle an outline bend it by a pixel or two. Along steps of depth, every pixel is given to
/// the side whose colours nearby, off the rim itself, are more like its own, when they are much more so; it then takes
/// that side's inverse depth. Confidence of those given to the other side is kMovedConfidence at most. guide: 8-bit
/// BGR.
constexpr float kMovedConfidence = 0.3F;
void align_outlines(cv::Mat1f& inverse_depth, cv::Mat1f& confidence, const cv::Mat3b& guide);

}  // namespace vantage
