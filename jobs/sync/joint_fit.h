#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "jobs/sync/epipolar_fit.h"
#include "jobs/sync/fundamental_fit.h"

namespace vantage::sync {

/// A run of at most two seconds of one pair of paths: what such a run has in common (an offset of the tracked corner,
/// an error of the lens model) is one unknown, and a wrong match is wrong as a whole.
struct PathRun {
  std::size_t pair = 0;
  std::vector<double> times_a_s;
  std::vector<Eigen::Vector2d> a;
};
/// The samples of a that b may see at offsets from min_s to max_s, in runs of three or more, thinned evenly to about
/// max_samples.
std::vector<PathRun> cut_into_runs(const std::vector<PathPair>& pairs, double min_s, double max_s,
                                   std::size_t max_samples);

struct JointOptions {
  std::optional<Pinhole> lens_a, lens_b;  ///< both known: five unknowns of geometry (E) instead of seven (F)
  bool estimate_rate = false;
  int width_a_px = 0;  ///< of a's pictures
};

struct JointFit {
  OffsetFit clock;    ///< tracks counts runs
  Eigen::Matrix3d F;  ///< x_b^T F x_a = 0, pixels, unit norm
};

/// Maximum likelihood of geometry and clock together: Sampson distances of a's samples from b's path at
/// t_b = (t_a - offset) / rate, each run with a bias of its own (covariance σ² I + σ_b² 1 1ᵀ) and Cauchy's weight.
/// σ starts at 6 px, wide enough to find the way from some tens of frames (graduated non-convexity, Blake & Zisserman
/// 1987), falls to 3 and 1.5 px and is then estimated. The geometry is F = U diag(1, s, 0) Vᵀ (Bartoli & Sturm 2004),
/// s = 1 between calibrated rays. Variances come from the information about the clock that is left when the geometry is
/// free to follow, less what noise alone would feign; the larger of Fisher's, inflated by χ², and the jackknife's
/// over clusters of runs. Empty when nothing is left that tells time.
std::optional<JointFit> fit_jointly(const std::vector<PathPair>& pairs, const std::vector<PointMatch>& still,
                                    const Eigen::Matrix3d& start_F, double start_offset_s, double start_rate,
                                    const JointOptions& options);

}  // namespace vantage::sync
