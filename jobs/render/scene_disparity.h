#pragma once
#include <opencv2/core.hpp>
#include <span>

#include "jobs/views/disparity_knots.h"

namespace vantage {

/// Depth of one recorded image.
struct KnotDepth {
  Pinhole pinhole;
  RigidTransform cam_from_world;
  cv::Mat1f z;  ///< 0: unknown
};

/// Disparities, before any mapping, that the scene has for the eyes of a knot: of what the depth maps show inside its
/// middle camera's picture, by area in that picture. Empty when none of them knows anything.
DisparityHistogram scene_disparities(const DisparityKnot& knot, std::span<const KnotDepth> depths);

}  // namespace vantage
