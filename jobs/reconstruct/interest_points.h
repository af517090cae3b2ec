#pragma once
#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "jobs/reconstruct/view_group.h"

namespace vantage {

/// Points of one view and what surrounds them.
struct InterestPoints {
  std::vector<Eigen::Vector2d> px;
  cv::Mat1f descriptors;  ///< a unit row of 128 per point
};

struct InterestPointOptions {
  int grid_px = 12;          ///< side of the cells, the best point of which is taken
  double quality = 0.002;    ///< least eigenvalue, relative to the image's 99.9th percentile
  double descriptor_px = 5;  ///< diameter of the keypoint; the descriptor reaches about 3 times as far
};

/// Where both eigenvalues of the gradient covariance are large (Shi and Tomasi 1994), one per grid cell, so that points
/// cover the image; then a SIFT descriptor. (Klose et al. use SURF, which is patented and absent from Debian's OpenCV.)
/// up: a world direction that gives all views' descriptors a common orientation, so cameras may be rolled.
InterestPoints find_interest_points(const View& view, const Eigen::Vector3d& up, const InterestPointOptions& options);

/// Mean of the cameras' own up directions: unit.
Eigen::Vector3d common_up(const ViewGroup& group);

}  // namespace vantage
