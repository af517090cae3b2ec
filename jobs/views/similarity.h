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

/// The similarity that brings the centres of `from` onto those of `to` (same order), least squares: Umeyama, PAMI 1991.
/// Centres on a line leave the turn about it open, and those of a flat arc all but open (a tenth of a millimetre of sag
/// turned eight cameras at five metres by half a pixel): where they are off a line by less than a tenth of
/// scene_distance (rms, units of `to`) the orientations give the rotation and the spread of the centres the scale.
/// Needs two poses with different centres.
Similarity align_poses(std::span<const RigidTransform> from, std::span<const RigidTransform> to, double scene_distance);

/// From the views' world to the calibration's. Identity without anchors. Throws Error(BadInput) when fewer than two
/// anchors name images that have a pose; an anchor of a static camera stands for all its frames.
/// scene_distance: from the cameras, in units of the calibration.
Similarity calibration_from_views(const std::vector<Anchor>& anchors, const Calibration& calibration,
                                  double scene_distance);

}  // namespace vantage
