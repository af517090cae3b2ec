#pragma once
#include <vector>

#include "jobs/reconstruct/interest_points.h"
#include "jobs/reconstruct/line_of_movement.h"
#include "jobs/reconstruct/view_group.h"

namespace vantage {

/// Points of several views that possibly are one point of the scene (Klose et al. 2011, §6.1).
struct MatchSet {
  struct Member {
    int view = 0;
    int point = 0;  ///< index into the view's InterestPoints
  };
  std::vector<Member> members;  ///< the reference first; at most one per view
};

struct MatchOptions {
  double max_ratio = 0.85;        ///< nearest over second nearest descriptor distance
  double epipolar_px = 2.0;       ///< for a static point
  double max_speed_widths = 1.0;  ///< image widths per second that things may move: widens the gate with time
  double max_gate_widths = 0.05;  ///< cap of the gate
};

/// Mutual best matches across all pairs of views within a gate that widens with the time between them, then one set per
/// point: the point with all its matches; largest sets first, no point in two sets. Sets hold at least 3 views of 2
/// cameras.
std::vector<MatchSet> find_match_sets(const ViewGroup& group, const std::vector<InterestPoints>& points,
                                      const MatchOptions& options);

/// Viewing rays of a set, times relative to the group's reference time.
std::vector<RayObservation> rays_of(const MatchSet& set, const ViewGroup& group,
                                    const std::vector<InterestPoints>& points);

}  // namespace vantage
