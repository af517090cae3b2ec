#pragma once
#include "jobs/sync/motion_offset.h"

namespace vantage::sync {

/// The ways that need no pose: "joint" (solve_free_pair), "fundamental" (align_by_nine_points) and "mean"
/// (mean_of_roots). coarse: the frame-accurate step's vote, which the last two start from; without one they start from
/// the joint solution. Fills offset, num_matches, contrast, scan and figures of the answer.
void answer_without_poses(MotionAnswer& answer, const MotionInput& input, const std::vector<TrackMatch>& matches,
                          const std::string& subframe, const std::optional<CodeVote>& coarse, const OffsetRange& range,
                          const VerdictLimits& limits);

}  // namespace vantage::sync
