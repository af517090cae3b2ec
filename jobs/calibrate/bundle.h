#pragma once
#include "jobs/calibrate/sparse_model.h"

namespace vantage {

struct BundleReport {
  int num_observations = 0;
  int num_dropped = 0;  ///< observations farther off than max_error_px after the first round
  double rms_px = 0;    ///< per coordinate pair: root mean square distance
  double mean_px = 0;   ///< mean distance
};

/// Bundle adjustment: poses, points, focal lengths and the lens terms of each camera's model, minimising distances in
/// px under a soft-L1 loss (Triggs et al. 2000). Two rounds; between them observations farther off than max_error_px
/// are dropped, and points seen less than twice. Principal points stay: pictures of one place do not tell them.
BundleReport refine_bundle(SparseModel& model, double max_error_px);

/// Removes lens terms that the pictures do not prove. A camera whose lens moves no pixel by more than 1 px becomes a
/// pinhole when that costs less than 2 % of the error: its pictures then need no resampling, which would blur them.
BundleReport drop_idle_lenses(SparseModel& model, double max_error_px, const BundleReport& before);

}  // namespace vantage
