#pragma once
#include "jobs/calibrate/sparse_model.h"

namespace vantage {

/// What of the lenses is solved for besides their models' own terms.
struct LensFreedom {
  bool centre = false;  ///< the principal point, weakly held at the picture's centre; else fixed where it is
  bool whole = false;   ///< two focal lengths and four terms of distortion, whatever the model has (OPENCV)
  bool shared = false;  ///< one physical lens took all pictures, which are of one size
};

struct BundleOptions {
  double max_error_px = 4;  ///< farther off, a measurement is none
  LensFreedom lens;
};

struct BundleReport {
  int num_observations = 0;
  int num_dropped = 0;  ///< observations that were too far off
  double rms_px = 0;    ///< per coordinate pair: root mean square distance
  double mean_px = 0;   ///< mean distance
  LensFreedom lens;
};

/// Bundle adjustment: poses, points, focal lengths and the lens terms of each camera's model, minimising distances in
/// px under Cauchy's loss (Triggs et al. 2000). Three rounds; after each, observations farther off than five robust
/// standard deviations, at most max_error_px, are dropped, and points seen less than twice.
BundleReport refine_bundle(SparseModel& model, const BundleOptions& options);

/// Robust standard deviation of one coordinate of the measurements, from the median of their distances.
double noise_px(const SparseModel& model);

/// Distance between where an observation was measured and where the model sees it; infinite behind the camera.
double error_px(const SparseModel& model, const SparseModel::Observation& observation);

}  // namespace vantage
