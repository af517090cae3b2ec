#pragma once
#include <filesystem>
#include <vector>

#include "jobs/calibrate/picture_pair.h"
#include "jobs/calibrate/sparse_model.h"
#include "jobs/calibrate/survey.h"

namespace vantage {

/// How COLMAP 3.8's incremental mapper (Schönberger & Frahm 2016) is run.
struct MapperOptions {
  std::string lens = "SIMPLE_RADIAL";  ///< model of every camera
  double focal_guess = 1.2;            ///< in longer sides of the picture
  double max_reproj_error_px = 4;
  bool free_lens = false;  ///< distortion is solved for as cameras are added; else it stays 0
  bool loose = false;      ///< cameras are placed by fewer points and from narrower first pairs
};

/// Poses and points from matches. work: a private folder, made and emptied. Returns an empty model when no two pictures
/// have enough in common. The same matches give the same model, bit by bit: the mapper has one thread, with more
/// its sums vary. The outputs are checked, not COLMAP's exit
/// statuses, which are 0 for some failures and not 0 for "no initial pair". Throws Error(Resource) when COLMAP is
/// missing or runs out of memory.
SparseModel map_with_colmap(const Survey& survey, const std::vector<PicturePair>& pairs,
                            const std::filesystem::path& work, const MapperOptions& options);

}  // namespace vantage
