#include "jobs/views/stereo_rig.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "jobs/views/render_options.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// Distance of the eyes that gives a point at one distance the disparity asked for.
double baseline_for_percent(const RenderOptions& options, const Pinhole& middle, double inverse_convergence,
                            const std::string& where) {
  const double inverse_distance = options.baseline_percent_at > 0 ? 1 / options.baseline_percent_at : 0;
  const double per_baseline_px = middle.fx * std::abs(inverse_convergence - inverse_distance);
  if (per_baseline_px <= 1e-9 * middle.fx * std::max(inverse_convergence, inverse_distance))
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: is {}, but points at baseline_percent_at = {} have no disparity, whatever the "
                            "baseline: name a distance other than the convergence distance ({})",
                            where, options.baseline_percent, options.baseline_percent_at,
                            inverse_convergence > 0 ? fmt::format("{:.4g}", 1 / inverse_convergence) : "infinity"));
  return options.baseline_percent / 100 * middle.width / per_baseline_px;
}

double baseline_of(const RenderOptions& options, const Pinhole& middle, const RigRequest& request,
                   double inverse_convergence) {
  if (options.baseline > 0) return options.baseline;
  if (options.baseline_percent > 0) return baseline_for_percent(options, middle, inverse_convergence, request.where);
  if (request.baseline) return *request.baseline;
  return 2 * request.centre_distance * std::sin(options.eye_azimuth_deg * std::numbers::pi / 360);
}

}  // namespace

Pinhole StereoRig::eye_pinhole(const Pinhole& middle, double sign) const {
  Pinhole eye = middle;
  eye.cx -= 0.5 * sign * focal_baseline * inverse_convergence;
  return eye;
}

RigidTransform StereoRig::eye_pose(const RigidTransform& middle, double sign) const {
  RigidTransform eye = middle;
  eye.t.x() += 0.5 * sign * baseline;
  return eye;
}

StereoRig stereo_rig(const RenderOptions& options, const Pinhole& middle, const RigRequest& request) {
  StereoRig rig;
  const double convergence = options.convergence > 0 ? options.convergence : request.default_convergence;
  rig.inverse_convergence = convergence > 0 ? 1 / convergence : 0;
  rig.baseline = baseline_of(options, middle, request, rig.inverse_convergence);
  rig.focal_baseline = middle.fx * rig.baseline;
  return rig;
}

}  // namespace vantage
