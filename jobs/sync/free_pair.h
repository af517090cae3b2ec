#pragma once
#include "jobs/sync/free_scan.h"
#include "jobs/sync/joint_fit.h"
#include "jobs/sync/verdict.h"

namespace vantage::sync {

struct FreePairInput {
  std::vector<PathPair> pairs;    ///< the same points in both cameras, but for some
  std::vector<PointMatch> still;  ///< of the static scene; may be empty
  OffsetRange range;
  std::optional<Pinhole> lens_a, lens_b;
  double frame_s = 0;  ///< the longer of the two cameras' frames
  int width_a_px = 0;  ///< of a's pictures
};

struct FreePairAnswer {
  FreeScan scan;
  std::optional<JointFit> fit;
  /// How surely the fit is better than the best other one: Vuong's (1989) statistic over runs, infinite without
  /// another.
  double lead = 0;
  double rival_offset_s = 0;
};

/// Clock of two cameras whose relative pose is unknown: scan_free() over the whole range, fit_jointly() from each of
/// its modes, the one that explains most. The rate is estimated when the overlap is long enough to tell it from the
/// offset.
FreePairAnswer solve_free_pair(const FreePairInput& input);

/// Fills offset, rate, std, inliers, determined and the sentence, as judge_fit() does for pairs with known cameras.
void judge_free_pair(PairOffset& offset, const FreePairAnswer& answer, const VerdictLimits& limits);

}  // namespace vantage::sync
