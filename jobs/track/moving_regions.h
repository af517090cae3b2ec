#pragma once
#include <functional>
#include <opencv2/core.hpp>
#include <optional>

namespace vantage::track {

/// Grey picture of a frame, 8-bit, undistorted.
using GreyFrames = std::function<cv::Mat1b(int frame)>;

/// The static scene as a static camera sees it: per-pixel median of up to 31 frames spread over the clip.
cv::Mat1b background_plate(int num_frames, const GreyFrames& grey);

/// The least difference of two pictures that is not their noise: four robust standard deviations, at least 8 levels.
double noise_threshold(const cv::Mat1b& difference);

/// 255 where a picture differs from a reference by more than its noise over more than single pixels; widened by a few
/// pixels.
cv::Mat1b changed_pixels(const cv::Mat1b& picture, const cv::Mat1b& reference);

/// Where things move, frame by frame. Static camera: against the plate. Moving camera: against the previous frame,
/// brought over by the motion of the background.
class MovingRegions {
 public:
  explicit MovingRegions(std::optional<cv::Mat1b> plate) : plate_(std::move(plate)) {}
  /// previous_to_this: homography of the background; only used without a plate, where an empty one gives an empty mask.
  cv::Mat1b mask(const cv::Mat1b& grey, const cv::Mat1b& previous, const cv::Mat& previous_to_this) const;

 private:
  std::optional<cv::Mat1b> plate_;
};

}  // namespace vantage::track
