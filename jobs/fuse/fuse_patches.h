#pragma once
#include <functional>
#include <vector>

#include "schema/formats/patches.h"

namespace vantage {

/// Distance between neighbouring patches of one group around a patch, world units: what "near" means there.
using PatchSpacing = std::function<double(const Patch&)>;

struct FuseOptions {
  double merge_distance = 0.5;  ///< of the spacing
  double kappa = 0.5;           ///< of Eq. 9, of the spacing
  int min_support = 2;  ///< other groups that must have seen a static surface nearby, where the shot has five or
                        ///< more groups in time: what one group alone claims is mostly wrong
  double max_validity =
      1.5;  ///< a moving patch may become valid over so many group durations: motion is linear only locally
};

struct FuseReport {
  int num_in = 0, num_static = 0, num_moving = 0, num_merged = 0, num_unsupported = 0;
};

/// One model from the patches of all groups (those of a group share t0 and t1).
/// Static patches (velocity exactly 0) of different groups that lie near each other and satisfy Eq. 9 become one: the
/// one seen by most images, moved along its normal to their mean, valid over the union of their times. Moving ones are
/// compared at the middle of the time that their groups share; they merge when their motions agree, too.
/// Order of the result and all values depend on the input's order only.
std::vector<Patch> fuse_patches(const std::vector<std::vector<Patch>>& groups, const PatchSpacing& spacing,
                                const FuseOptions& options, FuseReport& report);

}  // namespace vantage
