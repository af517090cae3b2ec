#pragma once
/// A moment's depth with what the frames before and after tell: depth that does not flicker.
#include <opencv2/core.hpp>
#include <span>

#include "jobs/vision/maps.h"
#include "schema/formats/camera.h"

namespace vantage {

/// Another frame of the camera and the way there.
struct DepthFrame {
  DepthMap depth;
  RigidTransform cam_from_world;
  FlowMap to_frame;  ///< from the image to this frame
};

/// Depth of the points seen in the image as this frame tells it: taken along the motion, and into the image's pose,
/// which differs when the camera moves. Confidence: the frame's times the motion's. 0 where it tells nothing.
DepthMap carried_depth(const DepthFrame& frame, const Pinhole& pinhole, const RigidTransform& cam_from_world);

/// Weighted median of inverse depths by confidence, then the mean of those within `agreement` of it. Things that come
/// nearer evenly stay where they are: what one frame says too near, the other says too far.
/// Confidence: the surest one's times the share of all that agrees, and no less than the image's own where that holds.
DepthMap steady_depth(const DepthMap& own, std::span<const DepthMap> carried, double agreement);

}  // namespace vantage
