#pragma once
#include "jobs/sync/time_jumps.h"
#include "schema/formats/shutter.h"

namespace vantage::sync {

struct ShutterInput {
  const std::vector<PathPair>& pairs;
  ResidualAt residual;
  OffsetFit clock;  ///< of the same pairs
  int height_a_px = 0, height_b_px = 0;
  double frame_b_s = 0;
};

/// Row y of a camera is exposed readout * (y / height - 0.5) after its time stamp, so b's path is looked up
/// readout_b u_b - readout_a u_a too late, u being the rows' places, and a residual is its slope over time times that
/// and the offset's error. Runs of two seconds share a bias, Cauchy's weight a run. Names a and b are left to the
/// caller.
PairShutter shutter_information(const ShutterInput& input);

}  // namespace vantage::sync
