#pragma once
#include <opencv2/core.hpp>

#include "jobs/vision/maps.h"

namespace vantage {

/// 1200 px wide, two rows of two: the picture; depth in turbo over 1/z with a legend in world units; its confidence;
/// how far the image's own edges agree, before anything else was heard (both: black 0, white 1).
cv::Mat3b depth_preview(const cv::Mat3b& bgr, const DepthMap& depth, const cv::Mat1f& edges_agree);

}  // namespace vantage
