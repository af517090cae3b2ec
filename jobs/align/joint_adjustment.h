#pragma once
#include "jobs/align/joint_problem.h"

namespace vantage::align {

struct JointResult {
  std::vector<JointCamera> cameras;   ///< as adjusted, offset_std_s and rate_std the posterior's; the reference's are 0
  int num_moving = 0, num_still = 0;  ///< points that took part
  JointNoise noise;
  /// Median distance of the moving points' samples: cameras as given, and adjusted.
  double error_before_px = 0, error_after_px = 0;
  double cost_before = 0, cost_after = 0;  ///< robust
  double largest_change_s = 0;             ///< of a clock, in the middle of its footage
  bool accepted = false;                   ///< false: the cameras as given are the better answer, `verdict` says why
  std::string verdict;                     ///< a sentence
};

/// Bundle adjustment of poses, focal lengths, background and clocks at once, with moving points as cubic B-splines over
/// shot time and one constant offset per track; Triggs et al. 2000 for the robust part. A point's spline is looked up
/// at offset + rate · t, so that clocks are unknowns like any other. Points that do not fit their cameras are left
/// out; noise is estimated alongside. The answer is accepted when the robust cost falls and no clock leaves what the
/// pairs said by more than three of their (and its own) standard deviations. Deterministic.
JointResult adjust_jointly(const JointScene& scene);

}  // namespace vantage::align
