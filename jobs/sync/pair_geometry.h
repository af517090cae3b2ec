#pragma once
#include <Eigen/Core>
#include <optional>

#include "jobs/sync/epipolar_pencil.h"
#include "schema/formats/calibration.h"
#include "schema/formats/frame_table.h"

namespace vantage::sync {

/// Where a calibrated camera is at any moment of its footage.
class CameraPath {
 public:
  /// moving: poses between frames are interpolated; else one pose holds for all.
  CameraPath(const Calibration& calibration, const FrameTable& table, bool moving);
  const Pinhole& pinhole() const { return pinhole_; }
  bool is_static() const { return poses_.size() == 1; }
  /// cam_from_world; empty where a moving camera has no pose within half a second.
  std::optional<RigidTransform> at(double time_s) const;

 private:
  Pinhole pinhole_;
  std::vector<double> times_s_;  // of poses_
  std::vector<RigidTransform> poses_;
};

/// x_b^T F x_a = 0 for undistorted pixels of one moment; scaled to unit norm.
Eigen::Matrix3d fundamental_matrix(const Pinhole& a, const RigidTransform& a_from_world, const Pinhole& b,
                                   const RigidTransform& b_from_world);

/// Signed first-order (Sampson) distance of a correspondence from F: Hartley & Zisserman 2003, §11.4.3. Pixels.
double sampson_px(const Eigen::Matrix3d& F, const Eigen::Vector2d& a, const Eigen::Vector2d& b);

/// The epipolar geometry of two cameras at a moment of each.
class PairGeometry {
 public:
  PairGeometry(CameraPath a, CameraPath b);
  /// Signed Sampson distance of two observations made at time_a_s and time_b_s of their footages; empty without poses.
  std::optional<double> residual_px(const Eigen::Vector2d& a, double time_a_s, const Eigen::Vector2d& b,
                                    double time_b_s) const;
  int width_a_px() const { return a_.pinhole().width; }
  /// Of two static cameras.
  EpipolarPencil pencil() const;

 private:
  CameraPath a_, b_;
  std::optional<Eigen::Matrix3d> fixed_;  // when both cameras are static
};

/// Whether a camera has an intrinsic model and at least one pose.
bool is_calibrated(const Calibration& calibration, const std::string& camera);

}  // namespace vantage::sync
