#pragma once
#include <opencv2/core.hpp>

#include "schema/formats/camera.h"

namespace vantage {

/// The pinhole that undistorted images of a lens have: same size, K chosen so that no border is empty beyond what the
/// lens itself lacks. Identity (the lens's own K) for PINHOLE models.
Pinhole undistorted_pinhole(const LensModel& lens);

/// Takes footage pixels to undistorted ones; bilinear. Free when camera.filmed is empty.
class Undistorter {
 public:
  explicit Undistorter(const CameraModel& camera);
  /// bgr: 8 or 16 bits or float, in the footage's pixels. Returns the same size as camera.pinhole.
  cv::Mat apply(const cv::Mat& bgr) const;
  /// mask: 0 or 255, in the footage's pixels; what the lens did not see is 0.
  cv::Mat1b apply_mask(const cv::Mat1b& mask) const;
  bool is_identity() const { return map_x_.empty(); }

 private:
  cv::Mat map_x_, map_y_;
};

/// Footage pixel (centres at +0.5) of a point in the camera's frame, through the lens as filmed.
cv::Point2d distort(const LensModel& lens, const cv::Point2d& normalised);

}  // namespace vantage
