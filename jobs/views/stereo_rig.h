#pragma once
/// Two eyes beside a camera.
#include <optional>

#include "jobs/views/disparity_curve.h"
#include "schema/formats/camera.h"

namespace vantage {

struct RenderOptions;

/// Parallel eyes, half the baseline to either side along the camera's x axis, sensors shifted so that points at the
/// convergence distance coincide. A point has the same y in both eyes, wherever the camera stands: a rectified pair.
struct StereoRig {
  double baseline = 0;             ///< distance of the eyes, world units
  double focal_baseline = 0;       ///< times focal length, px
  double inverse_convergence = 0;  ///< of the distance without disparity; 0: infinity

  /// Of a point at depth z: x in the left eye less x in the right one.
  double disparity_px(double z) const { return focal_baseline * (1 / z - inverse_convergence); }
  /// An eye of a middle camera; sign: +1 left, -1 right.
  Pinhole eye_pinhole(const Pinhole& middle, double sign) const;
  RigidTransform eye_pose(const RigidTransform& middle, double sign) const;
};

/// The rig that a [[render]] asks for. centre_distance: of the scene's centre from the middle camera. baseline: of
/// views.json. default_convergence: where the options name none; 0: infinity. Throws Error(BadInput) when
/// baseline_percent has no answer: its distance is the convergence distance.
struct RigRequest {
  double centre_distance = 1, default_convergence = 0;
  std::optional<double> baseline;
  std::string where;  ///< of the option baseline_percent, for messages
};
StereoRig stereo_rig(const RenderOptions& options, const Pinhole& middle, const RigRequest& request);

/// Depth-image-based stereo: a point at distance z of the middle camera is drawn at its place there, plus this along x.
struct DisparityRule {
  double sign = 0;  ///< +1 left eye, -1 right eye
  StereoRig rig;
  DisparityCurve curve;
  double shift_px(double z) const { return 0.5 * sign * curve(rig.disparity_px(z)); }
};

}  // namespace vantage
