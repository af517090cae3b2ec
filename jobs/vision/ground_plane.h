#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "schema/formats/calibration.h"

namespace vantage {

/// Points p with up · p = height; up: unit, away from the ground.
struct GroundPlane {
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();
  double height = 0;
  std::size_t num_points = 0;  ///< that lie on it
};

/// The plane that most of the lower sparse points lie on, among planes within 30 degrees of rough_up; RANSAC with a
/// fixed seed, then least squares. inlier_distance: world units.
/// Empty when fewer than 50 points or 15 % of all lie on it.
std::optional<GroundPlane> find_ground_plane(const std::vector<SparsePoint>& points, const Eigen::Vector3d& rough_up,
                                             double inlier_distance);

}  // namespace vantage
