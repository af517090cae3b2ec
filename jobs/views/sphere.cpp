#include "jobs/views/sphere.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace vantage {
namespace {
constexpr double kDegPerRad = 180 / std::numbers::pi;
}

SpherePoint sphere_point(const Navspace& navspace, const Eigen::Vector3d& world) {
  const Eigen::Vector3d d = navspace.axes * (world - navspace.centre);
  return {std::atan2(d.x(), d.z()) * kDegPerRad, std::atan2(d.y(), std::hypot(d.x(), d.z())) * kDegPerRad, d.norm()};
}

Eigen::Vector3d world_point(const Navspace& navspace, const SpherePoint& place) {
  const double az = place.azimuth_deg / kDegPerRad, el = place.elevation_deg / kDegPerRad;
  const Eigen::Vector3d d(std::sin(az) * std::cos(el), std::sin(el), std::cos(az) * std::cos(el));
  return navspace.centre + place.radius * (navspace.axes.transpose() * d);
}

RigidTransform look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, const Eigen::Vector3d& up) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  Eigen::Vector3d right = forward.cross(up);
  if (right.norm() < 1e-9) right = forward.unitOrthogonal();  // straight above: any horizon is level
  right.normalize();
  RigidTransform pose;
  pose.R.row(0) = right.transpose();
  pose.R.row(1) = forward.cross(right).transpose();
  pose.R.row(2) = forward.transpose();
  pose.t = -pose.R * eye;
  return pose;
}

}  // namespace vantage
