#pragma once
/// The sphere that the cameras stand on (Klose et al. 2011, §5.1).
#include <Eigen/Core>

#include "schema/formats/camera.h"
#include "schema/formats/navspace.h"

namespace vantage {

/// A place around the scene's centre.
struct SpherePoint {
  double azimuth_deg = 0;  ///< -180 to 180; 0 is the front
  double elevation_deg = 0;
  double radius = 0;  ///< world units
};

/// Place of a point of the world, in the frame of navspace.centre and navspace.axes.
SpherePoint sphere_point(const Navspace& navspace, const Eigen::Vector3d& world);
/// Inverse of sphere_point.
Eigen::Vector3d world_point(const Navspace& navspace, const SpherePoint& place);
/// Camera at `eye` that looks at `target`, horizon level: its x axis is at right angles to `up`.
RigidTransform look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, const Eigen::Vector3d& up);

}  // namespace vantage
