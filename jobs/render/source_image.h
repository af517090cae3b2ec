#pragma once
#include <map>
#include <opencv2/core.hpp>

#include "jobs/vision/maps.h"
#include "schema/formats/camera.h"

namespace vantage {

/// A recorded image with all that is known of it.
struct SourceImage {
  ImageId id;
  double time_s = 0;
  Pinhole pinhole;
  RigidTransform cam_from_world;
  cv::Mat3f bgr;                 ///< undistorted, linear light, 0–1
  DepthMap depth;                ///< empty when depth is not used
  std::map<int, FlowMap> flows;  ///< by place of the other image
  cv::Mat1f alpha = {};          ///< of a matte, 0–1, by which bgr is premultiplied; empty: no matte
};

/// World point of a pixel at a depth along the optical axis.
Eigen::Vector3d world_of(const SourceImage& image, const Eigen::Vector2d& px, double z);
/// Bilinear; px continuous (centres at +0.5). 0 when one of the four samples is 0 or outside.
double sample_depth(const cv::Mat1f& z, const Eigen::Vector2d& px);

}  // namespace vantage
