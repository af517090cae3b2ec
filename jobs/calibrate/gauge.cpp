#include "jobs/calibrate/gauge.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "schema/base/error.h"

namespace vantage {
namespace {

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Eigen::Vector3d median_point(const std::vector<SparsePoint>& points) {
  Eigen::Vector3d out;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const auto& p : points) values.push_back(p.position[axis]);
    out[axis] = median(std::move(values));
  }
  return out;
}

}  // namespace

Eigen::Matrix3d viewing_axes(const Calibration& calibration) {
  Eigen::Vector3d down = Eigen::Vector3d::Zero(), ahead = Eigen::Vector3d::Zero();
  for (const auto& [image, pose] : calibration.cam_from_world) {
    down += pose.R.row(1).transpose();
    ahead += pose.R.row(2).transpose();
  }
  // Cameras all around a scene look ahead in all directions, or up and down evenly: any direction will do then.
  if (down.norm() < 1e-9) down = Eigen::Vector3d::UnitY();
  down.normalize();
  ahead -= down * down.dot(ahead);
  if (ahead.norm() < 1e-9) ahead = down.unitOrthogonal();
  ahead.normalize();
  Eigen::Matrix3d axes;
  axes << down.cross(ahead).transpose(), down.transpose(), ahead.transpose();
  return axes;
}

void normalise_world(Calibration& calibration) {
  check(!calibration.points.empty() && !calibration.cam_from_world.empty(), "a calibrated shot has points and cameras");
  const Eigen::Vector3d origin = median_point(calibration.points);
  const Eigen::Matrix3d axes = viewing_axes(calibration);
  std::vector<double> distances;
  for (const auto& [image, pose] : calibration.cam_from_world) distances.push_back((pose.centre() - origin).norm());
  const double scale = 1 / median(std::move(distances));
  for (auto& [image, pose] : calibration.cam_from_world) {
    const Eigen::Vector3d centre = scale * (axes * (pose.centre() - origin));
    pose.R = (pose.R * axes.transpose()).eval();
    pose.t = -pose.R * centre;
  }
  for (auto& point : calibration.points) point.position = (scale * (axes * (point.position - origin))).eval();
}

}  // namespace vantage
