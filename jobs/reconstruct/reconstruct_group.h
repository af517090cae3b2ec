#pragma once
#include <functional>
#include <string>
#include <vector>

#include "jobs/reconstruct/expansion.h"
#include "jobs/reconstruct/filters.h"
#include "jobs/reconstruct/match_sets.h"
#include "schema/formats/patches.h"

namespace vantage {

struct ReconstructOptions {
  int cell_px = 2;
  int iterations = 2;  ///< of expansion and filtering
  InterestPointOptions points;
  MatchOptions match;
  LineOfMovementOptions line;
  ExpansionOptions expansion;
  FilterOptions filter;
  int smoothing_rounds = 2;  ///< of the velocities, at the end
};

struct ReconstructReport {
  int num_points = 0, num_match_sets = 0, num_lines = 0, num_moving_lines = 0, num_seeds = 0;
  int num_tried = 0;  ///< expansions
  int num_patches = 0, num_moving = 0, num_filtered = 0, num_set_in_motion = 0;
  double coverage = 0;
};

struct Reconstruction {
  std::vector<Patch> patches;  ///< positions at the group's first image, valid from its first to its last
  ReconstructReport report;
};

/// Klose et al. 2011, §6.1, for one group of images. Same result for the same input, always. Fewer than 3 views or 2
/// cameras give no patches.
Reconstruction reconstruct_group(const ViewGroup& group, const ReconstructOptions& options,
                                 const std::function<void(double fraction, const std::string& phase)>& progress);

}  // namespace vantage
