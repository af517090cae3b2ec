#pragma once
#include <optional>
#include <vector>

#include "jobs/sync/pair_geometry.h"
#include "jobs/sync/timed_track.h"

namespace vantage::sync {

/// The path of one point in camera a and in camera b, each on its own footage time.
struct PathPair {
  TimedTrack a, b;
};

struct FitOptions {
  double max_epipolar_px = 6;  ///< samples farther from their epipolar line take no part
  bool estimate_rate = false;
  /// Bounds of the noise found: matched points beyond these are not worth much.
  double max_noise_px = 2, max_bias_px = 4;
};

/// t_a = offset_s + rate * t_b.
struct OffsetFit {
  double offset_s = 0, rate = 1;
  double std_s = 0;             ///< of offset_s + rate · pivot_b_s
  double rate_std = 0;          ///< 0 when the rate was not estimated
  double pivot_b_s = 0;         ///< moment of b at which the offset does not depend on the rate
  double noise_px = 0;          ///< of a sample about its track's mean residual
  double bias_px = 0;           ///< of the tracks' mean residuals
  double effective_tracks = 0;  ///< (Σ information)² / Σ information²: how many tracks the answer rests on
  int num_tracks = 0;           ///< with a weight above one half
};

/// Maximum likelihood offset, given the cameras: signed Sampson distances r of paired points against the one unknown.
/// Tracked points of a pair are seldom quite the same point, so a pair's residuals share an unknown bias b:
///   r_k = b + noise_k,  covariance σ² I + σ_b² 1 1ᵀ,
/// and a pair whose point crosses its epipolar lines at constant speed says no more than σ_b / speed, however many
/// samples it has. Pairs are weighed by Cauchy's function of their Mahalanobis distance; σ and σ_b are estimated
/// alongside (medians). Standard deviations are the larger of the Fisher information's (inflated by the reduced χ²) and
/// the jackknife's over clusters of pairs, times Student's factor for as few clusters as there are, and what a tenth of
/// a pixel of shared error would do: neighbouring points of one thing err together by what they share, and all of them
/// by what the calibration is off. What noise alone would make look like motion
/// across the epipolar lines is taken off the information first. Empty when nothing in the pairs tells time, or the
/// iteration leaves its start by over max_step_s.
std::optional<OffsetFit> fit_offset(const std::vector<PathPair>& pairs, const PairGeometry& geometry,
                                    double start_offset_s, double max_step_s, const FitOptions& options = {});

/// fit_offset with the rate wherever the pairs tell it to within half a frame over overlap_s; else for a rate of 1. May
/// leave its start by two frames.
std::optional<OffsetFit> fit_clock(const std::vector<PathPair>& pairs, const PairGeometry& geometry,
                                   double start_offset_s, double frame_s, double overlap_s,
                                   const FitOptions& options = {});

}  // namespace vantage::sync
