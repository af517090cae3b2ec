#pragma once
#include "jobs/reconstruct/patch_cloud.h"

namespace vantage {

struct FilterOptions {
  int min_views = 3;
  int window_cells = 2;      ///< the local region reaches so many cells to each side
  double regularity = 0.25;  ///< z of §6.1: least share of the local region's patches that satisfy Eq. 9
  int min_component = 10;    ///< patches; smaller islands are dropped
};

struct FilterReport {
  int in_front = 0, behind = 0, irregular = 0, velocity = 0, island = 0;
  int total() const { return in_front + behind + irregular + velocity + island; }
};

/// Removes what the last expansion got wrong, in this order, and rebuilds the cloud:
/// patches in front of a surface that more and better patches agree on; patches behind the surface in too many of their
/// views; patches unlike their neighbours (Eq. 9); patches that move unlike their neighbours; small islands.
FilterReport filter(PatchCloud& cloud, const FilterOptions& options);

/// Velocities of moving patches become the mean over the moving patches of their local region that satisfy Eq. 9: depth
/// motion of a single patch is noisy, and neighbours on a surface move nearly alike. Positions at the reference image's
/// time stay.
void smooth_velocities(PatchCloud& cloud, int window_cells);

}  // namespace vantage
