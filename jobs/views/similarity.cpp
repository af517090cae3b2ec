#include "jobs/views/similarity.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <optional>

#include "schema/base/error.h"

namespace vantage {
namespace {

/// Of the scene's distance: centres that are off a line by less (rms) say less of the turn about it than orientations.
constexpr double kOnALine = 0.1;

Eigen::MatrixX3d centres_of(std::span<const RigidTransform> poses) {
  Eigen::MatrixX3d rows(static_cast<Eigen::Index>(poses.size()), 3);
  for (std::size_t k = 0; k < poses.size(); ++k) rows.row(static_cast<Eigen::Index>(k)) = poses[k].centre().transpose();
  return rows;
}

/// The rotation nearest to m.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d u = svd.matrixU(), vt = svd.matrixV().transpose();
  return u * Eigen::Vector3d(1, 1, (u * vt).determinant() < 0 ? -1 : 1).asDiagonal() * vt;
}

/// Pose of the anchor's image; of a static camera's any image when that one has none.
std::optional<RigidTransform> pose_for(const Anchor& anchor, const Calibration& calibration) {
  if (const auto found = calibration.cam_from_world.find(anchor.image); found != calibration.cam_from_world.end())
    return found->second;
  std::optional<RigidTransform> only;
  for (const auto& [image, pose] : calibration.cam_from_world) {
    if (image.camera != anchor.image.camera) continue;
    if (only && (!only->R.isApprox(pose.R) || !only->t.isApprox(pose.t))) return std::nullopt;
    only = pose;
  }
  return only;
}

}  // namespace

RigidTransform Similarity::operator*(const RigidTransform& cam_from_world) const {
  RigidTransform pose;
  pose.R = cam_from_world.R * R.transpose();
  pose.t = -pose.R * (*this * cam_from_world.centre());
  return pose;
}

Similarity align_poses(std::span<const RigidTransform> from, std::span<const RigidTransform> to,
                       double scene_distance) {
  check(from.size() == to.size() && from.size() >= 2, "a similarity needs two poses");
  const Eigen::MatrixX3d x = centres_of(from), y = centres_of(to);
  const Eigen::RowVector3d mean_x = x.colwise().mean(), mean_y = y.colwise().mean();
  const Eigen::MatrixX3d dx = x.rowwise() - mean_x, dy = y.rowwise() - mean_y;
  check(dx.norm() > 0, "a similarity needs centres that differ");
  const Eigen::Vector3d spread =
      (dy.transpose() * dy / static_cast<double>(to.size())).eval().selfadjointView<Eigen::Lower>().eigenvalues();
  const double off_line = std::sqrt(std::max(0.0, spread[0] + spread[1]));
  Similarity s;
  if (off_line > kOnALine * scene_distance) {
    s.R = nearest_rotation(dy.transpose() * dx);
    s.scale = (dy.cwiseProduct(dx * s.R.transpose())).sum() / dx.squaredNorm();
  } else {
    Eigen::Matrix3d turned = Eigen::Matrix3d::Zero();
    for (std::size_t k = 0; k < from.size(); ++k) turned += to[k].R.transpose() * from[k].R;
    s.R = nearest_rotation(turned);
    s.scale = dy.norm() / dx.norm();
  }
  s.t = mean_y.transpose() - s.scale * (s.R * mean_x.transpose());
  return s;
}

Similarity calibration_from_views(const std::vector<Anchor>& anchors, const Calibration& calibration,
                                  double scene_distance) {
  if (anchors.empty()) return {};
  std::vector<RigidTransform> from, to;
  for (const Anchor& anchor : anchors)
    if (const auto pose = pose_for(anchor, calibration)) {
      from.push_back(anchor.cam_from_world);
      to.push_back(*pose);
    }
  if (from.size() < 2)
    throw Error(ErrorKind::BadInput,
                fmt::format("views.json: {} of {} anchors name images that have a pose, needs two or more", from.size(),
                            anchors.size()));
  return align_poses(from, to, scene_distance);
}

}  // namespace vantage
