#pragma once
/// Sparse matches of two pictures that may lie any distance apart: coarse-to-fine PatchMatch (Hu, Song & Li 2016) on a
/// grid of seeds.
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace vantage {

struct PatchMatchOptions {
  int spacing_px = 3;             ///< between seeds
  double max_motion_share = 0.4;  ///< longest motion looked for, of the longer side
  int rounds = 8;                 ///< propagation and search, per level
  double consistent_px = 3;       ///< a match that does not come back this close is dropped
};

struct SparseMatch {
  cv::Point at;        ///< pixel of the first picture
  cv::Point2f motion;  ///< px
};

/// Both directions, each row by row. The same on every run: random numbers are hashes of seed, level and round.
struct SparseMatches {
  std::vector<SparseMatch> a_to_b, b_to_a;
};
SparseMatches patch_matches(const cv::Mat1f& a, const cv::Mat1f& b, const PatchMatchOptions& options);

}  // namespace vantage
