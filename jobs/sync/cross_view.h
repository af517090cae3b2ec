#pragma once
#include <functional>
#include <opencv2/core.hpp>
#include <vector>

#include "jobs/sync/epipolar_fit.h"
#include "jobs/sync/identity.h"

namespace vantage::sync {

/// Grey picture of a frame, 8-bit, undistorted.
using GreyFrames = std::function<cv::Mat1b(int frame)>;

/// Two corners that look alike are seldom the same point to a pixel. Here a's point is sought in b's pictures
/// (pyramidal Lucas-Kanade from a's picture to the one of b nearest in time, started at b's track) in up to 30 frames,
/// and b's path is moved by what is found, as a straight line over time. The search looks only at appearance, so it
/// does not pull the offset to where it stands. Matches in which a's point is not found there and back, or not
/// steadily, are left out. first frames and times come from the tracks; offset_s need only be right to a frame or two.
std::vector<PathPair> refine_matches(const std::vector<TimedTrack>& a, const std::vector<TimedTrack>& b,
                                     const std::vector<TrackMatch>& matches, const FrameTable& table_a,
                                     const FrameTable& table_b, const GreyFrames& grey_a, const GreyFrames& grey_b,
                                     double offset_s);

}  // namespace vantage::sync
