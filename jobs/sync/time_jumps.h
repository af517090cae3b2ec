#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "jobs/sync/epipolar_fit.h"

namespace vantage::sync {

/// Distance of sample k of a pair's a from its epipolar line when b's path is looked up at time_b_s. Empty where b does
/// not see it.
using ResidualAt = std::function<std::optional<double>(const PathPair& pair, std::size_t k, double time_b_s)>;

ResidualAt residual_by(const PairGeometry& geometry);
/// x_b^T F x_a = 0, pixels.
ResidualAt residual_by(const Eigen::Matrix3d& F);

/// One moment at which two clocks shift against each other by whole frames, though their time stamps do not say so:
/// frames were lost there and the rest closed up.
struct TimeJump {
  double time_a_s = 0;  ///< last moment before it, on a's footage time
  double time_b_s = 0;  ///< the same on b's
  int frames_lost = 0;  ///< 1 or more
  bool lost_by_b = false;
  double before_s = 0, after_s = 0;  ///< offsets of the two pieces against the fit that was looked at
  double evidence = 0;  ///< log likelihood ratio to steady drift or none, a run of half a second counting once
  bool longer_is_before = false;  ///< which piece has more runs
};

struct JumpInput {
  const std::vector<PathPair>& pairs;
  ResidualAt residual;
  double offset_s = 0, rate = 1;  ///< a fit of the whole: t_a = offset_s + rate t_b
  double std_px = 1;              ///< of residuals when the clock is right
  double frame_a_s = 0, frame_b_s = 0;
};

/// Likelihood ratio over all moments and pairs of offsets within ±3.5 frames: residuals are taken at each offset (no
/// slope is assumed), Cauchy's loss a run. A step that is no whole number of frames (drift, a moved camera) is none.
std::optional<TimeJump> find_time_jump(const JumpInput& input);

/// The samples of a on the jump's longer side; pairs with fewer than four of them are left out.
std::vector<PathPair> longer_piece(const std::vector<PathPair>& pairs, const TimeJump& jump);

/// "cam1 lost 1 frame at 3.20 s of its footage without its time stamps showing it; the offset holds before"
std::string describe(const TimeJump& jump, const std::string& a, const std::string& b);

}  // namespace vantage::sync
