#pragma once
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

namespace vantage {

/// Frames spread evenly over a camera's footage, at most max_frames, rising.
std::vector<int> spread_frames(int num_frames, int max_frames);

/// What a static camera sees behind all that moves: the median over time of each pixel and channel. pictures: 8-bit, of
/// one size, one at least. Where something covers a pixel more than half the time it stays.
cv::Mat median_plate(const std::vector<cv::Mat>& pictures);

}  // namespace vantage
