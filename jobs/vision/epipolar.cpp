#include "jobs/vision/epipolar.h"

#include <Eigen/LU>
#include <cmath>

namespace vantage {

TwoView::TwoView(const Pinhole& a, const RigidTransform& a_from_world, const Pinhole& b,
                 const RigidTransform& b_from_world) {
  const Eigen::Matrix3d b_from_a = b_from_world.R * a_from_world.R.transpose();
  H = b.K() * b_from_a * a.K().inverse();
  e = b.K() * (b_from_world.t - b_from_a * a_from_world.t);
}

std::optional<Eigen::Vector2d> TwoView::project(const Eigen::Vector2d& px_a, double inverse_depth) const {
  const Eigen::Vector3d q = homogeneous(px_a, inverse_depth);
  if (q.z() <= 1e-9) return std::nullopt;
  return Eigen::Vector2d(q.x() / q.z(), q.y() / q.z());
}

double TwoView::px_per_inverse_depth(const Eigen::Vector2d& px_a, double inverse_depth) const {
  const Eigen::Vector3d q = homogeneous(px_a, inverse_depth);
  if (q.z() <= 1e-9) return 0;
  return std::hypot(e.x() * q.z() - q.x() * e.z(), e.y() * q.z() - q.y() * e.z()) / (q.z() * q.z());
}

std::optional<InverseDepthFit> fit_inverse_depth(const TwoView& views, const Eigen::Vector2d& px_a,
                                                 const Eigen::Vector2d& px_b) {
  const Eigen::Vector3d n = views.homogeneous(px_a, 0);
  const Eigen::Vector2d slope(views.e.x() - px_b.x() * views.e.z(), views.e.y() - px_b.y() * views.e.z());
  const Eigen::Vector2d rest(px_b.x() * n.z() - n.x(), px_b.y() * n.z() - n.y());
  const double squared = slope.squaredNorm();
  if (squared < 1e-12) return std::nullopt;
  InverseDepthFit fit;
  fit.inverse_depth = slope.dot(rest) / squared;
  const auto nearest = views.project(px_a, fit.inverse_depth);
  if (!nearest) return std::nullopt;
  fit.residual_px = (*nearest - px_b).norm();
  fit.px_per_inverse_depth = views.px_per_inverse_depth(px_a, fit.inverse_depth);
  return fit;
}

}  // namespace vantage
