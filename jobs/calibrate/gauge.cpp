#include "jobs/calibrate/gauge.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "jobs/vision/ground_plane.h"
#include "schema/base/error.h"
#include "schema/base/median.h"

namespace vantage {
namespace {

Eigen::Vector3d median_point(const std::vector<SparsePoint>& points) {
  Eigen::Vector3d out;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const auto& p : points) values.push_back(p.position[axis]);
    out[axis] = median(std::move(values));
  }
  return out;
}

struct Axes {
  Eigen::Vector3d down = Eigen::Vector3d::Zero(), ahead = Eigen::Vector3d::Zero();
};

Axes mean_axes(const Calibration& calibration) {
  Axes sum;
  for (const auto& [image, pose] : calibration.cam_from_world) {
    sum.down += pose.R.row(1).transpose();
    sum.ahead += pose.R.row(2).transpose();
  }
  // Cameras all around a scene look ahead in all directions, or up and down evenly: any direction will do then.
  if (sum.down.norm() < 1e-9) sum.down = Eigen::Vector3d::UnitY();
  sum.down.normalize();
  return sum;
}

Eigen::Matrix3d axes_with(const Eigen::Vector3d& down, Eigen::Vector3d ahead) {
  ahead -= down * down.dot(ahead);
  if (ahead.norm() < 1e-9) ahead = down.unitOrthogonal();
  ahead.normalize();
  Eigen::Matrix3d axes;
  axes << down.cross(ahead).transpose(), down.transpose(), ahead.transpose();
  return axes;
}

Eigen::Vector3d centre_of(const Calibration& calibration, const std::string& camera) {
  const auto image = calibration.cam_from_world.lower_bound({camera, 0});
  if (image == calibration.cam_from_world.end() || image->first.camera != camera)
    throw Error(ErrorKind::BadInput,
                fmt::format("[calibrate] known_distance names camera '{}', which could not be placed", camera));
  return image->second.centre();
}

double distance_in(const Calibration& calibration, const KnownDistance& known,
                   const std::optional<GroundPlane>& ground) {
  const Eigen::Vector3d from = centre_of(calibration, known.from);
  if (known.to != "ground") return (centre_of(calibration, known.to) - from).norm();
  if (!ground)
    throw Error(ErrorKind::BadInput,
                "[calibrate] known_distance is to the ground, but no ground plane was found; name two cameras");
  return std::abs(ground->up.dot(from) - ground->height);
}

}  // namespace

Eigen::Matrix3d viewing_axes(const Calibration& calibration) {
  const Axes axes = mean_axes(calibration);
  return axes_with(axes.down, axes.ahead);
}

WorldFacts normalise_world(Calibration& calibration, const std::optional<KnownDistance>& known) {
  check(!calibration.points.empty() && !calibration.cam_from_world.empty(), "a calibrated shot has points and cameras");
  const Eigen::Vector3d origin = median_point(calibration.points);
  std::vector<double> distances;
  for (const auto& [image, pose] : calibration.cam_from_world) distances.push_back((pose.centre() - origin).norm());
  const double radius = median(std::move(distances));
  const Axes rough = mean_axes(calibration);
  const auto ground = find_ground_plane(calibration.points, -rough.down, 0.01 * radius);
  const Eigen::Matrix3d axes = axes_with(ground ? Eigen::Vector3d(-ground->up) : rough.down, rough.ahead);
  const double scale = known ? known->metres / distance_in(calibration, *known, ground) : 1 / radius;
  for (auto& [image, pose] : calibration.cam_from_world) {
    const Eigen::Vector3d centre = scale * (axes * (pose.centre() - origin));
    pose.R = (pose.R * axes.transpose()).eval();
    pose.t = -pose.R * centre;
  }
  for (auto& point : calibration.points) point.position = (scale * (axes * (point.position - origin))).eval();
  WorldFacts facts{.ground_y = std::nullopt, .is_metric = known.has_value()};
  if (ground) facts.ground_y = scale * (ground->up.dot(origin) - ground->height);
  return facts;
}

}  // namespace vantage
