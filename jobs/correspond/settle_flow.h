#pragma once
/// Matches of what stood still, brought onto the epipolar lines; those of what moved stay as far beside them as found.
#include "jobs/correspond/flow_pair.h"
#include "jobs/correspond/stereo_flow.h"

namespace vantage {

/// `flow` is nearly right, found freely in both directions of the picture; greys of like levels. The lines are first
/// moved to where the pictures show them, so poses may put them a few pixels aside. Along the lines matches are
/// refined (refine_on_planes); across them small deviations are noise and go. Matches that do not come back within
/// consistent_px stay as they are.
void settle_on_lines(const PosedPicture& a, const PosedPicture& b, float consistent_px, FlowPair& flow);

}  // namespace vantage
