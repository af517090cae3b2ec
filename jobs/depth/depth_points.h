#pragma once
/// One cloud from the depth maps of a moment: points that two or more cameras agree on, each once.
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "jobs/vision/maps.h"
#include "schema/formats/camera.h"
#include "schema/formats/patches.h"

namespace vantage {

struct PosedDepth {
  Pinhole pinhole;
  RigidTransform cam_from_world;
  DepthMap depth;
  cv::Mat3b bgr;
};

struct DepthPointsOptions {
  double agreement = 0.01;      ///< two cameras' depths of a point differ by no more than this share
  int min_cameras = 2;          ///< that see the point where it is, the first one included
  float min_confidence = 0.2F;  ///< depths below are not used: filled gaps, lone doubtful votes
};

/// Points with normal (towards the camera) and colour; position is the mean of what the agreeing cameras say. A surface
/// that several see gives one point per pixel of the camera that sees it largest. World units.
std::vector<Patch> consistent_points(std::span<const PosedDepth> images, const DepthPointsOptions& options);

/// Unit normal in the camera's frame, towards the camera, from depths beside the pixel on its own surface (inverse
/// depths within 5 % of its own); zero where the pixel has none on both sides.
Eigen::Vector3f normal_in_cam(const Pinhole& pinhole, const cv::Mat1f& z, int x, int y);

}  // namespace vantage
