#pragma once
#include <opencv2/core.hpp>
#include <vector>

namespace vantage {

/// Frames spread evenly over a camera's footage, at most max_frames, rising.
std::vector<int> spread_frames(int num_frames, int max_frames);

/// The median over time of each pixel and channel. pictures: 8-bit, of one size, one at least. Where something covers a
/// pixel more than half the time it stays.
cv::Mat median_plate(const std::vector<cv::Mat>& pictures);

/// What a static camera sees behind all that moves.
struct Plate {
  cv::Mat bgr;           ///< median_plate()
  cv::Mat steady;        ///< 255 where most pictures show what the median shows: background for sure
  int noise_levels = 0;  ///< farther from the median, in levels of 255, a pixel shows something else
};

/// pictures: 8-bit BGR, of one size, one at least. What covers a pixel more than half the time is steady if it keeps
/// still.
Plate make_plate(const std::vector<cv::Mat>& pictures);

/// 255 where a picture of the plate's camera shows something else than the plate, with a rim of a few pixels.
cv::Mat what_moves(const cv::Mat& bgr, const Plate& plate);

}  // namespace vantage
