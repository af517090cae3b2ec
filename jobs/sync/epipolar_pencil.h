#pragma once
#include <optional>

#include "schema/formats/camera.h"

namespace vantage::sync {

/// The epipolar planes of two static cameras as one number, the plane's angle about the baseline, which both cameras
/// read off their own pixels: what one sees on a plane at a moment the other sees on the same plane.
class EpipolarPencil {
 public:
  struct View {
    Pinhole pinhole;
    RigidTransform cam_from_world;
  };
  EpipolarPencil(const View& a, const View& b);

  /// False when a camera sees the other, or nearly: then planes cross its picture in all directions, and no thing in
  /// it has a first and a last plane.
  bool usable() const { return usable_; }
  enum class Side { A, B };
  /// Radians.
  double angle_rad(Side side, const Eigen::Vector2d& px) const;
  /// How fast the angle grows across the epipolar lines at a pixel.
  double rad_per_px(Side side, const Eigen::Vector2d& px) const;
  /// Where a plane meets the straight line through `through_px` across its epipolar line: angles as pixels that move
  /// smoothly with the angle. Empty when it does not.
  std::optional<Eigen::Vector2d> pixel_of(Side side, double angle_rad, const Eigen::Vector2d& through_px) const;

 private:
  const View& view(Side side) const { return side == Side::A ? a_ : b_; }
  Eigen::Vector3d line_of(Side side, double angle_rad) const;
  bool sees_other(Side side) const;

  View a_, b_;
  Eigen::Vector3d along_, zero_, quarter_;  // world axes: baseline, plane of angle 0, plane of angle 90°
  bool usable_ = false;
};

}  // namespace vantage::sync
