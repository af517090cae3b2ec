#pragma once
/// What fit_jointly() minimises, as a Ceres problem.
#include <ceres/problem.h>

#include <Eigen/Geometry>

#include "jobs/sync/joint_fit.h"

namespace vantage::sync {

/// Standard deviations of a sample about its run's bias and of the biases. Pixels.
struct RunNoise {
  double sample_px = 1, bias_px = 1;
};

/// The unknowns. b's path is looked up at t_b = pivot_b + (t_a - pivot_a - shift) / rate; with the pivots in the middle
/// of the overlap shift and rate are nearly independent.
struct JointState {
  Eigen::Quaterniond U, V;
  double s = 1;
  double clock[2] = {0, 0};  ///< shift (s), 1000 (rate - 1)
  double pivot_a_s = 0, pivot_b_s = 0;
  Eigen::Matrix3d Ta, Tb;  ///< fixed: pixels to rays, or Hartley's normalisation

  double rate() const { return 1 + 1e-3 * clock[1]; }
  double time_b_s(double time_a_s) const { return pivot_b_s + (time_a_s - pivot_a_s - clock[0]) / rate(); }
  double offset_s() const { return pivot_a_s + clock[0] - rate() * pivot_b_s; }
  Eigen::Matrix3d fundamental() const;  ///< in pixels, unit norm
};

struct JointData {
  const std::vector<PathRun>& runs;
  const std::vector<PathPair>& pairs;
  const std::vector<PointMatch>& still;
  RunNoise noise;
  const JointOptions& options;
};

/// Empty when no run is seen by b.
std::optional<JointState> start_state(const std::vector<PathRun>& runs, const std::vector<PathPair>& pairs,
                                      const Eigen::Matrix3d& F, double offset_s, double rate,
                                      const JointOptions& options);

/// Cauchy's scale: the mean squared whitened residual of a run at which it counts half.
constexpr double kRunLossScale = 2;

/// One residual block a run, then one a still match; parameter blocks U, V, s, clock of the state, in this order.
/// A run's residuals are whitened and divided by √n, its loss multiplied by n.
std::unique_ptr<ceres::Problem> make_problem(JointState& state, const JointData& data,
                                             std::vector<ceres::ResidualBlockId>& run_blocks,
                                             std::vector<ceres::ResidualBlockId>& still_blocks);

/// Levenberg-Marquardt from the state on.
void improve(JointState& state, const JointData& data);

}  // namespace vantage::sync
