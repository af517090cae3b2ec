#pragma once
#include "jobs/calibrate/bundle.h"

namespace vantage {

/// Bundle adjustment with as much of the lenses solved for as the pictures prove, no more: the principal point or not,
/// the model's own terms or all of OPENCV's, a lens each or, for pictures of one size, one lens for all. The same
/// measurements are explained each way; the least error wins after every free term has paid for itself (as in Akaike
/// 1974, at a price that covers what no lens model describes). Then drop_idle_lenses().
BundleReport choose_lenses(SparseModel& model, const BundleOptions& options);

/// Removes lens terms that the pictures do not prove. A camera whose lens moves no pixel by more than 1 px becomes a
/// pinhole when that costs less than 2 % of the error: its pictures then need no resampling, which would blur them.
BundleReport drop_idle_lenses(SparseModel& model, const BundleOptions& options, const BundleReport& before);

}  // namespace vantage
