#pragma once
#include <opencv2/core.hpp>

#include "jobs/correspond/flow_pair.h"

namespace vantage {

/// The picture half-way in time between a and b (8 bit), from motion both ways: each motion field is carried to the
/// middle, bilinearly, pixels that do not come back counting little; there both pictures are looked up and averaged as
/// much of each as arrived. No knowledge of depth or cameras: a plain yardstick for motion fields.
cv::Mat middle_frame(const cv::Mat& a, const cv::Mat& b, const FlowPair& flow);

/// 10 log10(255² / mean squared error) over all channels.
double psnr_db(const cv::Mat& picture, const cv::Mat& truth);

}  // namespace vantage
