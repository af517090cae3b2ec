#pragma once
/// Worlds that differ by scale, rotation and shift.
#include <Eigen/Core>
#include <span>
#include <vector>

#include "schema/formats/calibration.h"
#include "schema/formats/views_file.h"

namespace vantage {

/// y = scale * R * x + t.
struct Similarity {
  double scale = 1;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return scale * (R * point) + t; }
  /// A camera's pose after its world has been mapped.
  RigidTransform operator*(const RigidTransform& cam_from_world) const;
};

/// The similarity that brings poses `from` onto poses `to` (same order), least squares over their centres (Umeyama, PAMI
/// 1991) and over points scene_distance (units of `to`) along their axes: that is how far off what they see would be.
/// Centres alone tell the turn about an arc's chord by its small sagitta only. Scale and shift are by the centres, which
/// must not all coincide.
Similarity align_poses(std::span<const RigidTransform> from, std::span<const RigidTransform> to, double scene_distance);

/// From the views' world to the calibration's. Identity without anchors. Throws Error(BadInput) when fewer than two
/// anchors name images that have a pose; an anchor of a static camera stands for all its frames.
/// scene_distance: from the cameras, in units of the calibration.
Similarity calibration_from_views(const std::vector<Anchor>& anchors, const Calibration& calibration,
                                  double scene_distance);

}  // namespace vantage
