#include "jobs/navspace/sphere_frame.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "jobs/vision/ground_plane.h"
#include "schema/base/error.h"
#include "schema/base/median.h"

namespace vantage {
namespace {

using Poses = std::vector<std::vector<RigidTransform>>;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Mean over cameras of the mean over a camera's poses.
template <class Of>
auto camera_mean(const Poses& poses, Of of) {
  decltype(of(poses.front().front())) sum = 0 * of(poses.front().front());
  for (const auto& camera : poses)
    for (const RigidTransform& pose : camera) sum += of(pose) / static_cast<double>(camera.size());
  return decltype(sum)(sum / static_cast<double>(poses.size()));
}

/// Median depth of the sparse points that lie in front of the mean camera; empty when there are few.
std::optional<double> median_depth(const std::vector<SparsePoint>& points, const Vector3d& from, const Vector3d& axis) {
  std::vector<double> depths;
  for (const SparsePoint& p : points)
    if (const double z = axis.dot(p.position - from); z > 0) depths.push_back(z);
  if (depths.size() < 10) return std::nullopt;
  return median(std::move(depths));
}

/// The middle of the widest gap in azimuth lies opposite: where no camera stands, the numbers may jump.
Vector3d front_of_ring(const std::vector<Vector3d>& directions, const Vector3d& up) {
  const Vector3d x = up.unitOrthogonal(), y = up.cross(x);
  std::vector<double> angles;
  for (const Vector3d& d : directions) angles.push_back(std::atan2(d.dot(y), d.dot(x)));
  std::sort(angles.begin(), angles.end());
  double widest = -1, middle = 0;
  for (std::size_t k = 0; k < angles.size(); ++k) {
    const double next = k + 1 < angles.size() ? angles[k + 1] : angles[0] + 2 * std::numbers::pi;
    if (next - angles[k] <= widest) continue;
    widest = next - angles[k];
    middle = 0.5 * (next + angles[k]);
  }
  return -(std::cos(middle) * x + std::sin(middle) * y);
}

Matrix3d axes_of(const Poses& poses, const Vector3d& centre, const Vector3d& up) {
  std::vector<Vector3d> directions;
  Vector3d sum = Vector3d::Zero();
  for (const auto& camera : poses) {
    const Vector3d d = camera_mean({camera}, [](const RigidTransform& p) { return p.centre(); }) - centre;
    const Vector3d flat = d - up * up.dot(d);
    directions.push_back(flat.norm() > 1e-12 * d.norm() ? Vector3d(flat.normalized()) : Vector3d::Zero());
    sum += directions.back();
  }
  const bool ring = sum.norm() < 0.3 * static_cast<double>(directions.size());
  const Vector3d front = ring ? front_of_ring(directions, up) : Vector3d(sum.normalized());
  Matrix3d axes;
  axes << up.cross(front).transpose(), up.transpose(), front.transpose();
  return axes;
}

}  // namespace

std::optional<Vector3d> axes_meeting_point(const Poses& poses) {
  const auto across = [](const RigidTransform& p) {
    return Matrix3d(Matrix3d::Identity() - p.R.row(2).transpose() * p.R.row(2));
  };
  const Matrix3d a = camera_mean(poses, across);
  const Vector3d b = camera_mean(poses, [&](const RigidTransform& p) { return Vector3d(across(p) * p.centre()); });
  const Vector3d spread = Eigen::SelfAdjointEigenSolver<Matrix3d>(a).eigenvalues();
  if (spread[0] < 1e-3 * spread[2]) return std::nullopt;
  const Vector3d centre = a.ldlt().solve(b);
  for (const auto& camera : poses)
    for (const RigidTransform& pose : camera)
      if ((pose * centre).z() <= 0) return std::nullopt;
  return centre;
}

SphereFrame sphere_frame(const Poses& poses, const std::vector<SparsePoint>& points) {
  check(!poses.empty(), "a sphere needs a camera");
  const auto centre_of = [](const RigidTransform& p) { return p.centre(); };
  const Vector3d middle = camera_mean(poses, centre_of);
  const Vector3d axis =
      camera_mean(poses, [](const RigidTransform& p) { return Vector3d(p.R.row(2).transpose()); }).normalized();
  const double spacing =
      std::sqrt(camera_mean(poses, [&](const RigidTransform& p) { return (p.centre() - middle).squaredNorm(); }));
  SphereFrame frame;
  if (const auto meeting = axes_meeting_point(poses)) {
    frame.centre = *meeting;
    frame.centre_from = "optical axes";
  } else if (const auto depth = median_depth(points, middle, axis)) {
    frame.centre = middle + *depth * axis;
    frame.centre_from = "sparse points";
  } else {
    frame.centre = middle + 5 * std::max(spacing, 1e-6) * axis;
    frame.centre_from = "camera spacing";
  }
  frame.radius = camera_mean(poses, [&](const RigidTransform& p) { return (p.centre() - frame.centre).norm(); });
  Vector3d up =
      -camera_mean(poses, [](const RigidTransform& p) { return Vector3d(p.R.row(1).transpose()); }).normalized();
  frame.up_from = "cameras";
  if (const auto ground = find_ground_plane(points, up, 0.01 * frame.radius)) {
    up = ground->up;
    frame.up_from = "ground plane";
  }
  frame.axes = axes_of(poses, frame.centre, up);
  return frame;
}

}  // namespace vantage
