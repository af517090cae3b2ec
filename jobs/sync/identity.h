#pragma once
#include <vector>

#include "jobs/sync/timed_track.h"

namespace vantage::sync {

/// Two tracks, one of each camera, that may show the same point.
struct TrackMatch {
  std::size_t a = 0, b = 0;  ///< indices into the two lists
  double distance = 0;       ///< of the most alike looks: 0 the same, 2 the opposite
  bool mutual = false;       ///< each is the other's best
};

/// Which tracks look alike, at any frames of theirs: identity does not depend on time. For each track of a the up to
/// `num_best` tracks of b nearest to it, ordered by a, then by distance; those farther than max_distance are left out.
std::vector<TrackMatch> match_by_look(const std::vector<TimedTrack>& a, const std::vector<TimedTrack>& b, int num_best,
                                      double max_distance);

}  // namespace vantage::sync
