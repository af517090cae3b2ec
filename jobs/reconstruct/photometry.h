#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "jobs/reconstruct/view_group.h"

namespace vantage {

/// Side of a patch: 7 x 7 samples, one pixel of the reference image apart.
constexpr int kPatchSide = 7;
constexpr int kPatchSamples = kPatchSide * kPatchSide;

/// A moving tangent plane as its reference view sees it. The plane m . X = 1 in the reference camera's frame has an
/// inverse depth that is linear in the pixel: at px + (dx, dy) it is w + gx dx + gy dy. In these parameters, and in the
/// velocity, all image positions are ratios of linear functions.
struct TangentPlane {
  int reference = 0;                                   ///< view
  Eigen::Vector2d px = Eigen::Vector2d::Zero();        ///< fixed: the patch moves along this pixel's ray only
  double inverse_depth = 0;                            ///< w, 1 / world units
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();     ///< gx, gy per pixel
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< world units per second
};

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
Vector6d parameters(const TangentPlane& plane);  ///< w, gx, gy, vx, vy, vz
TangentPlane with_parameters(const TangentPlane& plane, const Vector6d& parameters);

/// Plane through a world point (at the reference view's time) with a unit normal towards the camera; empty when it is
/// seen edge-on.
std::optional<TangentPlane> tangent_plane(const ViewGroup& group, int reference, const Eigen::Vector3d& point,
                                          const Eigen::Vector3d& normal, const Eigen::Vector3d& velocity);
/// Centre at the reference view's time; unit normal towards the reference camera.
Eigen::Vector3d centre_at_reference_time(const ViewGroup& group, const TangentPlane& plane);
Eigen::Vector3d normal_of(const ViewGroup& group, const TangentPlane& plane);

/// Normalised cross-correlation of one view with the reference.
struct Correlation {
  double ncc = -1;
  Vector6d gradient = Vector6d::Zero();  ///< of 1 - ncc
  Matrix6d hessian = Matrix6d::Zero();   ///< Gauss-Newton: 1 - ncc is half the squared distance of unit vectors
};

/// How a patch looks in its reference view, ready to be compared with other views. Keeps a reference to the group.
class ReferenceTexture {
 public:
  /// Empty when the patch leaves the image or has no texture (standard deviation below min_sigma grey levels).
  static std::optional<ReferenceTexture> sample(const ViewGroup& group, int reference, const Eigen::Vector2d& px,
                                                double min_sigma = 2.0);
  /// The samples move along the velocity to the view's time. Empty when they leave the image, lie behind the camera, or
  /// have no texture there.
  std::optional<Correlation> compare(const TangentPlane& plane, int view, bool derivatives) const;

 private:
  ReferenceTexture(const ViewGroup& group) : group_(&group) {}
  const ViewGroup* group_;
  Eigen::Matrix<double, kPatchSamples, 1> unit_;  ///< zero mean, unit length
};

}  // namespace vantage
