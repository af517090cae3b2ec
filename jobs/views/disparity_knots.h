#pragma once
#include <vector>

#include "jobs/views/stereo_rig.h"
#include "schema/formats/camera.h"

namespace vantage {

/// A moment of the film at which the scene's disparities are looked at: a second apart. Maps that fit the scene are
/// made for each knot, and a frame's is the mean of the two around it, so that depth does not breathe, although every
/// frame is made on its own.
struct DisparityKnot {
  double weight = 0;  ///< in the frame's map; sum 1 over its knots
  Pinhole pinhole;    ///< the middle camera at the knot
  RigidTransform cam_from_world;
  StereoRig rig;
  std::vector<ImageId> images;  ///< whose depth says what the scene is
};

/// For each frame of a film of num_frames: its knots' frames (counted from 0) and their weights, which change smoothly.
struct KnotWeight {
  int frame;
  double weight;
};
std::vector<std::vector<KnotWeight>> knot_weights(int num_frames, double fps);

}  // namespace vantage
