#pragma once
#include <functional>

#include "jobs/reconstruct/build_patch.h"

namespace vantage {

struct ExpansionOptions {
  BuildOptions build;
  int max_patches = 100000;
  double coverage = 0.95;  ///< stop when this share of the textured cells of the main views is filled
};

struct ExpansionReport {
  int num_tried = 0, num_added = 0;
  double coverage = 0;
};

/// Grows the cloud along its surfaces (§6.1): for every patch, best score first, the empty neighbouring cells in each
/// camera's main view get a patch where the ray through the cell meets the patch's plane, with its normal and velocity.
/// progress: called now and then with the share that is covered.
ExpansionReport expand(PatchCloud& cloud, const ExpansionOptions& options, const std::function<void(double)>& progress);

/// Gives static patches beside moving ones on the same surface the neighbour's velocity to start from; those that fit
/// clearly better so become moving, and pass it on. Slow surfaces look static to a patch that grew from a static one.
/// Returns how many have changed.
int spread_motion(PatchCloud& cloud, const BuildOptions& options);

}  // namespace vantage
