#include "jobs/sync/pair_geometry.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "jobs/vision/epipolar.h"
#include "schema/base/error.h"

namespace vantage::sync {
namespace {

constexpr double kMaxPoseGapS = 0.5;

RigidTransform interpolate(const RigidTransform& p, const RigidTransform& q, double u) {
  const Eigen::Quaterniond R = Eigen::Quaterniond(p.R).slerp(u, Eigen::Quaterniond(q.R));
  const Eigen::Vector3d centre = (1 - u) * p.centre() + u * q.centre();
  RigidTransform out{.R = R.toRotationMatrix(), .t = Eigen::Vector3d::Zero()};
  out.t = -(out.R * centre);
  return out;
}

}  // namespace

CameraPath::CameraPath(const Calibration& calibration, const FrameTable& table, bool moving)
    : pinhole_(calibration.camera(table.camera).pinhole) {
  for (int frame = 0; frame < table.num_frames(); ++frame) {
    const auto found = calibration.cam_from_world.find({table.camera, frame});
    if (found == calibration.cam_from_world.end()) continue;
    times_s_.push_back(table.pts_s[static_cast<std::size_t>(frame)]);
    poses_.push_back(found->second);
    if (!moving) return;
  }
  check(!poses_.empty(), "only calibrated cameras have a path");
}

std::optional<RigidTransform> CameraPath::at(double time_s) const {
  if (is_static()) return poses_.front();
  const auto after = std::upper_bound(times_s_.begin(), times_s_.end(), time_s);
  const auto k =
      static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(after - times_s_.begin(), 1, std::ssize(times_s_) - 1));
  const double t0 = times_s_[k - 1], t1 = times_s_[k];
  const double u = std::clamp((time_s - t0) / (t1 - t0), 0.0, 1.0);
  if (std::abs(time_s - (u < 0.5 ? t0 : t1)) > kMaxPoseGapS) return std::nullopt;
  return interpolate(poses_[k - 1], poses_[k], u);
}

Eigen::Matrix3d fundamental_matrix(const Pinhole& a, const RigidTransform& a_from_world, const Pinhole& b,
                                   const RigidTransform& b_from_world) {
  const TwoView views(a, a_from_world, b, b_from_world);
  Eigen::Matrix3d cross;
  cross << 0, -views.e.z(), views.e.y(), views.e.z(), 0, -views.e.x(), -views.e.y(), views.e.x(), 0;
  const Eigen::Matrix3d F = cross * views.H;
  return F / F.norm();
}

double sampson_px(const Eigen::Matrix3d& F, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector3d line_b = F * a.homogeneous(), line_a = F.transpose() * b.homogeneous();
  const double slope = std::sqrt(line_b.head<2>().squaredNorm() + line_a.head<2>().squaredNorm());
  return slope > 0 ? b.homogeneous().dot(line_b) / slope : 0;
}

PairGeometry::PairGeometry(CameraPath a, CameraPath b) : a_(std::move(a)), b_(std::move(b)) {
  if (a_.is_static() && b_.is_static()) fixed_ = fundamental_matrix(a_.pinhole(), *a_.at(0), b_.pinhole(), *b_.at(0));
}

std::optional<double> PairGeometry::residual_px(const Eigen::Vector2d& a, double time_a_s, const Eigen::Vector2d& b,
                                                double time_b_s) const {
  if (fixed_) return sampson_px(*fixed_, a, b);
  const auto pose_a = a_.at(time_a_s), pose_b = b_.at(time_b_s);
  if (!pose_a || !pose_b) return std::nullopt;
  return sampson_px(fundamental_matrix(a_.pinhole(), *pose_a, b_.pinhole(), *pose_b), a, b);
}

EpipolarPencil PairGeometry::pencil() const {
  check(a_.is_static() && b_.is_static(), "only static cameras have one pencil of epipolar planes");
  return {{a_.pinhole(), *a_.at(0)}, {b_.pinhole(), *b_.at(0)}};
}

bool is_calibrated(const Calibration& calibration, const std::string& camera) {
  if (!calibration.cameras.contains(camera)) return false;
  const auto first = calibration.cam_from_world.lower_bound({camera, 0});
  return first != calibration.cam_from_world.end() && first->first.camera == camera;
}

}  // namespace vantage::sync
