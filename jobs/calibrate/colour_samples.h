#pragma once
#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "schema/formats/camera.h"

namespace vantage {

/// A picture whose colours are compared with others: undistorted, with its pose.
struct PosedColourPicture {
  int camera = 0;  ///< index
  cv::Mat3b bgr;
  cv::Mat1b counts;  ///< 0 where the picture does not count; empty: all of it does
  Pinhole pinhole;
  RigidTransform cam_from_world;
};

/// The same small region seen by two cameras: mean linear light, red, green, blue.
struct ColourSample {
  int camera_a = 0, camera_b = 0;
  Eigen::Vector3d linear_a = Eigen::Vector3d::Zero(), linear_b = Eigen::Vector3d::Zero();
};

/// SIFT regions that match best both ways along epipolar lines, between each picture and its nearest ones of other
/// cameras. Regions with saturated or near-black pixels are left out. The same pictures give the same
/// samples.
std::vector<ColourSample> colour_samples(const std::vector<PosedColourPicture>& pictures);

}  // namespace vantage
