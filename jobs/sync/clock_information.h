#pragma once
#include "jobs/sync/joint_problem.h"

namespace vantage::sync {

struct ClockInformation {
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();  ///< of (shift at the pivots in s, rate); rate 0 when fixed
  double effective_runs = 0;                             ///< (Σ information)² / Σ information²
  int num_believed_runs = 0;                             ///< with a weight above one half
};

/// What the data of a finished fit say of its clock when the geometry may follow every change of it. Empty when noise
/// in the paths alone would look like that much.
std::optional<ClockInformation> clock_information(JointState state, const JointData& data);

}  // namespace vantage::sync
