#include "jobs/sync/epipolar_pencil.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace vantage::sync {
namespace {

/// The epipole's least distance from the picture, in parts of the picture's size.
constexpr double kMinEpipoleMargin = 0.1;

}  // namespace

EpipolarPencil::EpipolarPencil(const View& a, const View& b) : a_(a), b_(b) {
  const Eigen::Vector3d baseline = b.cam_from_world.centre() - a.cam_from_world.centre();
  const Eigen::Vector3d front = a.cam_from_world.R.row(2) + b.cam_from_world.R.row(2);
  along_ = baseline.normalized();
  zero_ = front - along_ * along_.dot(front);
  usable_ = baseline.norm() > 0 && zero_.norm() > 1e-3 && !sees_other(Side::A) && !sees_other(Side::B);
  zero_.normalize();
  quarter_ = along_.cross(zero_);
}

bool EpipolarPencil::sees_other(Side side) const {
  const View& here = view(side);
  const Eigen::Vector3d other = here.cam_from_world * view(side == Side::A ? Side::B : Side::A).cam_from_world.centre();
  // Lines through the epipole, wherever it lies in front or behind: a plane's line is the same either way.
  if (std::abs(other.z()) < 1e-9) return false;
  const Eigen::Vector2d epipole = here.pinhole.project(other);
  const double w = here.pinhole.width, h = here.pinhole.height, margin = kMinEpipoleMargin;
  return epipole.x() > -margin * w && epipole.x() < (1 + margin) * w && epipole.y() > -margin * h &&
         epipole.y() < (1 + margin) * h;
}

double EpipolarPencil::angle_rad(Side side, const Eigen::Vector2d& px) const {
  const Eigen::Vector3d ray = view(side).cam_from_world.R.transpose() * view(side).pinhole.ray(px);
  return std::atan2(ray.dot(quarter_), ray.dot(zero_));
}

double EpipolarPencil::rad_per_px(Side side, const Eigen::Vector2d& px) const {
  const double here = angle_rad(side, px);
  return std::hypot(angle_rad(side, px + Eigen::Vector2d::UnitX()) - here,
                    angle_rad(side, px + Eigen::Vector2d::UnitY()) - here);
}

Eigen::Vector3d EpipolarPencil::line_of(Side side, double angle_rad) const {
  const Eigen::Vector3d normal = along_.cross(std::cos(angle_rad) * zero_ + std::sin(angle_rad) * quarter_);
  return view(side).pinhole.K().inverse().transpose() * (view(side).cam_from_world.R * normal);
}

std::optional<Eigen::Vector2d> EpipolarPencil::pixel_of(Side side, double angle, const Eigen::Vector2d& through) const {
  const Eigen::Vector3d middle = line_of(side, angle_rad(side, through));
  const Eigen::Vector3d across(-middle.y(), middle.x(), middle.y() * through.x() - middle.x() * through.y());
  const Eigen::Vector3d line = line_of(side, angle), point = line.cross(across);
  const double slope = line.head<2>().norm() * across.head<2>().norm();
  if (std::abs(point.z()) < 0.2 * slope) return std::nullopt;
  return Eigen::Vector2d(point.head<2>() / point.z());
}

}  // namespace vantage::sync
