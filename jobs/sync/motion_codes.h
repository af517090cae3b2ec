#pragma once
/// Frame-accurate alignment by extremal points, binary codes and string matching: Klose et al. 2011, §4.1 (after Meyer
/// et al. 2008). Needs no calibration; camera motion must be smaller than the motion of what is tracked.
#include <cstdint>
#include <span>
#include <vector>

#include "jobs/sync/epipolar_scan.h"
#include "jobs/sync/identity.h"

namespace vantage::sync {

/// Which points of a path Douglas and Peucker (1973) keep: the ends, and all that the chords would miss by over
/// epsilon_px. Distances are to the chord itself, not its line, so the turn of a point that swings to and fro on a line
/// is kept.
std::vector<bool> douglas_peucker(std::span<const Eigen::Vector2d> path_px, double epsilon_px);

/// 1 where a path has an extremal point, 0 elsewhere (also at its two ends, which are the tracker's, not the motion's).
/// epsilon is found by bisection so that about keep_share of the points are kept.
std::vector<std::uint8_t> motion_code(std::span<const Eigen::Vector2d> path_px, double keep_share);

/// A code on the common time grid of both cameras: bit k is at (first + k) * step.
struct PlacedCode {
  int first = 0;
  std::vector<std::uint8_t> bits;
};
PlacedCode code_of(const TimedTrack& track, double step_s, double keep_share);

/// Matching ones, a one meeting a neighbour counting as well, over the geometric mean of the ones in the overlap when b
/// is delayed by `shift` steps: 0 to 1. 0 when they overlap in fewer than min_overlap bits.
double match_codes(const PlacedCode& a, const PlacedCode& b, int shift, int min_overlap);

struct CodeVote {
  double offset_s = 0;  ///< t_a = offset_s + t_b, whole steps
  double score = 0;     ///< sum over the pairs that agree
  double contrast = 0;  ///< score over that of the best offset two or more steps away; infinity when there is none
  int num_inliers = 0;  ///< pairs that agree: at most a step from their own best shift
};

/// Every match of tracks is a hypothesis of the shift; the one that most others agree with wins (RANSAC with every
/// hypothesis tried). num_inliers is 0 when there is nothing to match.
CodeVote vote_by_codes(const std::vector<TimedTrack>& a, const std::vector<TimedTrack>& b,
                       const std::vector<TrackMatch>& matches, const OffsetRange& range);

}  // namespace vantage::sync
