#pragma once
#include <map>
#include <opencv2/core.hpp>

#include "jobs/job_context.h"
#include "jobs/vision/undistort.h"
#include "schema/formats/calibration.h"
#include "schema/formats/clocks.h"
#include "schema/formats/colour.h"
#include "schema/formats/frame_table.h"

namespace vantage {

/// A job's view of the shot's pictures: undistorted, with pose and shot time. Needs the inputs "calibrate" and, for
/// pictures and times, "ingest/<camera>" of the cameras it is asked about; "align" for times.
class ShotImages {
 public:
  explicit ShotImages(const JobContext& context);
  const Calibration& calibration() const { return calibration_; }
  const Pinhole& pinhole(const ImageId& image) const { return calibration_.camera(image.camera).pinhole; }
  const RigidTransform& cam_from_world(const ImageId& image) const { return calibration_.pose(image); }
  /// Undistorted, 8-bit BGR, in the look that all cameras share (schema/formats/colour.h) when the calibration has one.
  /// Read anew every time: keep it.
  cv::Mat bgr(const ImageId& image);
  /// Like bgr() in linear light, 0–1 and, where the shared look brightens, above: frames of 8 or 16 bits, never rounded
  /// on the way.
  cv::Mat3f linear_bgr(const ImageId& image);
  /// Undistorted like bgr(): 255 where a pixel counts; empty when the job looks at no mask of that camera.
  cv::Mat1b mask(const ImageId& image);
  /// Undistorted like bgr(): the mask with its greys, 0–1; empty when the job looks at no mask of that camera.
  cv::Mat1f matte(const ImageId& image);
  /// What linear_bgr() makes of a colour in that camera's footage (8-bit sRGB, BGR).
  cv::Vec3f linear_colour(const std::string& camera, const cv::Vec3b& filmed) const;
  double time_s(const ImageId& image);

 private:
  cv::Mat3f in_linear_light(const std::string& camera, const cv::Mat& levels) const;
  const FrameTable& table(const std::string& camera);
  const Undistorter& undistorter(const std::string& camera);

  const JobContext& context_;
  Calibration calibration_;
  Clocks clocks_;
  std::map<std::string, FrameTable> tables_;
  std::map<std::string, Undistorter> undistorters_;
  std::map<std::string, CameraColour> looks_;  ///< by camera; none when pictures stay as filmed
};

/// A picture file as 8-bit BGR, and with as many bits as it has (8 or 16). Throws Error(Transient) when it cannot be
/// read.
cv::Mat read_picture(const std::filesystem::path& path);
cv::Mat read_deep_picture(const std::filesystem::path& path);
/// 8-bit PNG, or JPEG by the file's suffix. Throws Error(Resource).
void write_picture(const std::filesystem::path& path, const cv::Mat& picture);

}  // namespace vantage
