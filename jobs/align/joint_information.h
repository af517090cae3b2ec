#pragma once
#include <Eigen/Core>
#include <unordered_map>

#include "jobs/align/joint_problem.h"

namespace vantage::align {

/// Posterior covariance of the cameras' blocks.
struct CameraCovariance {
  std::unordered_map<const double*, Eigen::Index> column;  ///< first of a block that is not held
  Eigen::MatrixXd covariance;
  double reduced_chi2 = 1;
};

/// Each point's own unknowns are eliminated (Schur's complement); what is left is summed over points. The larger, by
/// the clocks' variances, of the inverse information (inflated by the reduced χ²) and the sandwich estimate over
/// clusters of moving points (Liang & Zeger 1986), as neighbouring tracks of one thing err together. clusters: one
/// number per moving point. What noise alone would tell of the clocks, by paths that follow it, is taken off first.
/// Expects the problem at its minimum; state is the one that it was built over, and is left as it was.
CameraCovariance covariance_of_cameras(const JointProblem& problem, JointState& state,
                                       const std::vector<long>& clusters);

}  // namespace vantage::align
