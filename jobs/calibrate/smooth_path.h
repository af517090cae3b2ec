#pragma once
#include <Eigen/Core>
#include <vector>

#include "schema/formats/camera.h"

namespace vantage {

/// A pose as a frame's points give it, and how certain it is. information: inverse covariance of (turn, shift) that
/// moves a point in the camera from p to p + turn × p + shift (radians, world units); zero where nothing was measured.
struct MeasuredPose {
  RigidTransform cam_from_world;
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
};

/// What a hand did rather than what each frame's noise says: the most probable path when a camera's acceleration and
/// change of turn from frame to frame are normal, of a size that the path itself tells: the spread of its second
/// differences less what the poses' own uncertainty makes of it (random-acceleration prior, Rauch, Tung & Striebel
/// 1965, solved as one banded system). So a tripod's path becomes still, a tremor stays. times_s: of the poses, rising.
/// Poses without information come to lie smoothly between their neighbours. Fewer than four poses stay as they are.
void smooth_path(const std::vector<double>& times_s, std::vector<MeasuredPose>& poses);

}  // namespace vantage
