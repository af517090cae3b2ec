#pragma once
#include <functional>

#include "jobs/reconstruct/build_patch.h"

namespace vantage {

struct ExpansionOptions {
  BuildOptions build;
  int max_patches = 60000;
  double coverage = 0.95;   ///< stop when this share of the textured cells of the main views is filled
};

struct ExpansionReport {
  int num_tried = 0, num_added = 0;
  double coverage = 0;
};

/// Grows the cloud along its surfaces (§6.1): for every patch, best score first, the empty neighbouring cells in each
/// camera's main view get a patch where the ray through the cell's centre meets the patch's plane, with its normal and
/// velocity. progress: called now and then with the share that is covered.
ExpansionReport expand(PatchCloud& cloud, const ExpansionOptions& options, const std::function<void(double)>& progress);

}  // namespace vantage
