#pragma once
/// Where the sphere of the cameras lies, and which way is up (Klose et al. 2011, §5.1).
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "schema/formats/calibration.h"

namespace vantage {

/// centre, axes (rows right, up, front) and radius as in Navspace.
struct SphereFrame {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  double radius = 1;
  std::string centre_from;  ///< "optical axes", "sparse points" or "camera spacing"
  std::string up_from;      ///< "ground plane" or "cameras"
};

/// poses: one or more per camera, all cameras counting the same: outer index camera.
SphereFrame sphere_frame(const std::vector<std::vector<RigidTransform>>& poses, const std::vector<SparsePoint>& points);

/// The point nearest to all optical axes, least squares; empty when the axes are almost parallel (mean spread below
/// about 2 degrees) or the point lies behind a camera.
std::optional<Eigen::Vector3d> axes_meeting_point(const std::vector<std::vector<RigidTransform>>& poses);

}  // namespace vantage
