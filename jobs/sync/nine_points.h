#pragma once
/// Subframe alignment without calibration: Klose et al. 2011, §4.2 (after Meyer et al. 2008).
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "jobs/sync/epipolar_fit.h"
#include "jobs/sync/fundamental_fit.h"

namespace vantage::sync {

/// A point seen by camera a, and where camera b sees it at the moment that the offset so far says and one step later.
/// Pixels.
struct MovingSample {
  Eigen::Vector2d a, b0, b1;
  const TimedTrack* path_b = nullptr;  ///< null: does not move
  double time_b_s = 0;                 ///< of b0
  unsigned cell = 0;                   ///< which neighbourhood of a it is of: what may err together
};

/// One solution of Eq. 4: a^T-side points fit b0 + fraction (b1 - b0).
struct SubframeRoot {
  double fraction = 0;
  Eigen::Matrix3d F;  ///< x_b^T F x_a = 0
};

/// All real solutions of det M(a) = 0 for nine samples, M(a) = A + a B, as a generalised eigenvalue problem after
/// Hartley's normalisation. Motion is taken as straight between the two moments. |fraction| > max_fraction is left out.
/// Samples that do not move may be among them: they only make B more singular than it is.
std::vector<SubframeRoot> solve_nine_points(std::span<const MovingSample> nine, double max_fraction);

struct NinePointInput {
  const std::vector<PathPair>& pairs;
  const std::vector<PointMatch>& still;  ///< points of the static scene; fill up to half of the rows
  const FrameTable& table_a;
  double frame_b_s = 0;
  bool static_cameras = true;  ///< one geometry for all frames; else one per frame
  double max_px = 1.5;         ///< samples nearer to their epipolar line agree with a root
};

struct SubframeVote {
  double offset_s = 0;      ///< t_a = offset_s + t_b
  double std_s = 0;         ///< half width of the mode
  double fraction = 0;      ///< of the last step: where most roots lie, weighed by support (raw roots' mean is biased)
  double std = 0;           ///< std_s in steps
  double support = 0;       ///< best root's Σ 1 - (r / max_px)² over the samples within
  int num_inliers = 0;      ///< samples within the tolerance at the best root
  double inlier_share = 0;  ///< of the samples looked at
  int num_roots = 0;        ///< that took part
};

/// Roots of many random nines over all frames, each scored by how well all samples agree with it (MSAC), from the
/// coarse offset on in steps of 1, 2, 4, 8 and 16 frames until nothing agrees better; then the mode for a step of one
/// frame. Deterministic. Empty when too few samples overlap or no root finds support.
std::optional<SubframeVote> align_by_nine_points(const NinePointInput& input, double coarse_offset_s);

struct MeanOfRoots {
  double offset_s = 0, std_s = 0;
  int num_frames = 0;
};

/// The paper's own last sentence on it: the mean over frames of what nines of one frame say, |a| ≤ 1. Kept to be
/// compared with: roots scatter by over half a frame and their cut-off range pulls the mean to the middle. Empty with
/// fewer than two frames of twelve samples.
std::optional<MeanOfRoots> mean_of_roots(const NinePointInput& input, double coarse_offset_s);

}  // namespace vantage::sync
