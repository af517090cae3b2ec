#pragma once
#include <vector>

#include "jobs/sync/identity.h"
#include "jobs/sync/pair_geometry.h"

namespace vantage::sync {

/// Offsets to try: t_a = offset + t_b.
struct OffsetRange {
  double min_s = 0, max_s = 0, step_s = 0;
  double duration_a_s = 0, duration_b_s = 0;  ///< of the clips
  int num() const;
  double at(int k) const { return min_s + k * step_s; }
  /// How long both clips run at an offset.
  double overlap_s(double offset_s) const;
};

/// All offsets at which two clips share at least two seconds or 40 % of the shorter one, within ±max_offset_s.
/// Steps are half of the shorter frame interval. num() is 0 when there are none.
OffsetRange plausible_offsets(const FrameTable& a, const FrameTable& b, double max_offset_s);

/// How well the tracks agree with the cameras' geometry at each offset.
struct OffsetScan {
  struct Mode {
    double offset_s = 0, score = 0;
  };
  OffsetRange range;
  std::vector<double> scores;
  std::vector<Mode> modes;  ///< local maxima that stand a tenth of the highest above the saddles around, best first
  void find_modes();        ///< from the scores
  /// Best mode's score over the best of the others', each per second of overlap, so that the next period of a periodic
  /// motion does not look worse only because less of it is seen. Modes with less than half of the best one's overlap do
  /// not count. Infinity when there is no other.
  double contrast() const;
};

/// For every track of a, the best of its matches: samples within max_epipolar_px of their epipolar line, weighed by
/// nearness (MSAC), less the track's median over all offsets. So a track whose motion stays within epipolar planes,
/// which fits always, has no vote, and many wrong matches, which fit anywhere, make no mode.
OffsetScan scan_offsets(const std::vector<TimedTrack>& a, const std::vector<TimedTrack>& b,
                        const std::vector<TrackMatch>& matches, const PairGeometry& geometry, const OffsetRange& range,
                        double max_epipolar_px);

}  // namespace vantage::sync
