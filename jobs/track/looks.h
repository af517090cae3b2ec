#pragma once
#include <vector>

#include "jobs/track/moving_regions.h"
#include "schema/formats/tracks.h"

namespace vantage::track {

/// Gives every moving track upright SIFT descriptors of its point (window about 1/22 of the picture's width) in up to
/// 6 of its frames, spread evenly: what tells which tracks of two cameras are the same point.
void describe_moving_tracks(std::vector<Track>& tracks, int num_frames, const GreyFrames& grey);

}  // namespace vantage::track
