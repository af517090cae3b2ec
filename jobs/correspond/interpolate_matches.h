#pragma once
#include <opencv2/core.hpp>
#include <vector>

#include "jobs/correspond/patch_match.h"

namespace vantage {

struct InterpolationOptions {
  int cell_px = 8;          ///< about the size of the cells that share one affine motion
  int num_neighbours = 60;  ///< matches that a cell is fitted to
  float edge_contrast = 6;  ///< grey levels per px that make a step twice as long
  float reach = 12;         ///< geodesic distance at which a match counts 1/e
  float inlier_px = 2;      ///< residual that counts half
};

/// Dense motion from sparse matches that contain outliers, sharp where the picture has edges (after Revaud et al. 2015
/// and Hu et al. 2017): the picture is cut into cells along its edges; each cell gets the affine motion that fits the
/// matches nearest to it, distances being measured along paths that avoid edges, robustly; cells try their
/// neighbours' motions, too. Zero when there is no match at all.
cv::Mat2f interpolate_matches(const cv::Mat1f& grey, const std::vector<SparseMatch>& matches,
                              const InterpolationOptions& options);

}  // namespace vantage
