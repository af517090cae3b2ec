#pragma once
#include <optional>

#include "jobs/reconstruct/patch_cloud.h"
#include "jobs/reconstruct/refine.h"

namespace vantage {

/// What is believed of a patch before its images are compared.
struct PatchGuess {
  int reference = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< at t = 0
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  bool moves = false;
};

struct BuildOptions {
  RefineOptions refine;
  double start_ncc = 0.3;         ///< a view helps the refinement from here on
  double seen_ncc = 0.6;          ///< a view sees the refined patch
  double min_ncc = 0.7;           ///< mean over the views that see it
  int min_views = 3;              ///< with the reference, of at least two cameras
  int extra_views_moving = 3;     ///< that a moving patch needs: one for each more unknown
  double max_speed_widths = 1.0;  ///< fastest motion, image widths per second at the patch's depth
  int max_cameras = 6;            ///< that take part in the refinement
  double max_angle_deg = 65;      ///< between the normal and the direction to a camera
};

/// Refines a guess against the views that may see it and decides whether it is a patch: enough views of two cameras
/// agree, a moving one at two different times and better than if it stood still, and a static one looks the same in
/// most frames of its own camera. Empty when it is not.
std::optional<LivePatch> build_patch(const PatchCloud& cloud, const PatchGuess& guess, const BuildOptions& options);

/// For seeds, of which it is not yet known whether they move: both ways. The moving patch wins when it moves by more
/// than half a pixel during the group and fits clearly better.
std::optional<LivePatch> build_seed(const PatchCloud& cloud, const PatchGuess& guess, const BuildOptions& options);

}  // namespace vantage
