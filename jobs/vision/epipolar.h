#pragma once
/// Two calibrated pinhole views of one static point. For pixel p of view a, a point at inverse depth w (1 / world
/// units, along a's optical axis) is seen in view b at the pixel of  H p + w e,  H = Kb R Ka^-1, e = Kb t  (plane plus
/// parallax, Hartley & Zisserman 2003, §13.3). Pixels are continuous: the centre of array element (x, y) is (x + 0.5, y
/// + 0.5).
#include <Eigen/Core>
#include <optional>

#include "schema/formats/camera.h"

namespace vantage {

struct TwoView {
  Eigen::Matrix3d H = Eigen::Matrix3d::Identity();  ///< where view b sees points at infinity
  Eigen::Vector3d e = Eigen::Vector3d::Zero();      ///< epipole in b, scaled by the baseline

  TwoView() = default;
  TwoView(const Pinhole& a, const RigidTransform& a_from_world, const Pinhole& b, const RigidTransform& b_from_world);

  Eigen::Vector3d homogeneous(const Eigen::Vector2d& px_a, double inverse_depth) const {
    return H * Eigen::Vector3d(px_a.x(), px_a.y(), 1) + inverse_depth * e;
  }
  /// Pixel of b; empty when the point is behind b.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector2d& px_a, double inverse_depth) const;
  /// Pixels that b's point moves along the epipolar line per unit of inverse depth; 0 behind b.
  double px_per_inverse_depth(const Eigen::Vector2d& px_a, double inverse_depth) const;
};

/// What a correspondence says of the depth of px_a.
struct InverseDepthFit {
  double inverse_depth = 0;
  double residual_px = 0;           ///< distance of px_b from the epipolar line's point at that depth
  double px_per_inverse_depth = 0;  ///< how sharply px_b tells the depth
};

/// Least-squares inverse depth of the point seen at px_a and px_b. Empty without parallax, or when the fit lies behind
/// b.
std::optional<InverseDepthFit> fit_inverse_depth(const TwoView& views, const Eigen::Vector2d& px_a,
                                                 const Eigen::Vector2d& px_b);

}  // namespace vantage
