#pragma once
#include <vector>

#include "jobs/sync/cross_view.h"
#include "jobs/sync/fundamental_fit.h"

namespace vantage::sync {

/// Points of the static scene that two static cameras both see: SIFT on each camera's temporal median picture where
/// nothing moves, mutual best matches by Lowe's ratio, those kept that one fundamental matrix explains. They hold at
/// every offset of the clocks and so pin the geometry to what does not move. Empty where the views are too far apart
/// for appearance (no matrix explains a third of the matches). Undistorted pixels, centres at +0.5.
std::vector<PointMatch> match_still_points(const GreyFrames& grey_a, int num_frames_a, const GreyFrames& grey_b,
                                           int num_frames_b);

}  // namespace vantage::sync
