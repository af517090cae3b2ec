#pragma once
/// Subframe alignment without calibration: Klose et al. 2011, §4.2 (after Meyer et al. 2008).
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "jobs/sync/epipolar_fit.h"

namespace vantage::sync {

/// A point seen by camera a, and where camera b sees it at the moment that the frame-accurate offset says and one frame
/// of b later. Pixels.
struct MovingSample {
  Eigen::Vector2d a, b0, b1;
};

/// One solution of Eq. 4: a^T-side points fit b0 + fraction (b1 - b0).
struct SubframeRoot {
  double fraction = 0;
  Eigen::Matrix3d F;  ///< x_b^T F x_a = 0
};

/// All real solutions of det M(a) = 0 for nine samples, M(a) = A + a B, as a generalised eigenvalue problem after
/// Hartley's normalisation. Motion is taken as straight between the two frames. |fraction| > max_fraction is left out.
std::vector<SubframeRoot> solve_nine_points(std::span<const MovingSample> nine, double max_fraction);

struct SubframeVote {
  double fraction = 0;      ///< where most roots lie, weighed by their inliers: the mean of raw roots is biased
  double std = 0;           ///< half width of that mode; for a single static geometry, of the fit
  int num_inliers = 0;      ///< samples within the tolerance at the best root
  double inlier_share = 0;  ///< of the samples looked at
  int num_roots = 0;        ///< that took part
};

/// Roots of many random nines, scored by how many samples agree with them (first-order distance below max_px).
/// groups: samples that share one epipolar geometry: all of them when both cameras are static, else one group per
/// frame. Deterministic. Empty when no group has enough samples or no root finds support.
std::optional<SubframeVote> vote_subframe(const std::vector<std::vector<MovingSample>>& groups, double max_px);

/// Samples of all pairs at the frames of a, b taken at coarse_offset_s and one frame of b later.
std::vector<std::vector<MovingSample>> moving_samples(const std::vector<PathPair>& pairs, const FrameTable& table_a,
                                                      double coarse_offset_s, double frame_b_s, bool static_cameras);

}  // namespace vantage::sync
