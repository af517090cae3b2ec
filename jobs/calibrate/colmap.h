#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "jobs/calibrate/sparse_model.h"

namespace vantage {

/// How COLMAP 3.8's programs are run, on the CPU and without a display.
struct ColmapOptions {
  std::string lens = "SIMPLE_RADIAL";  ///< model of every camera; one camera per folder of pictures
  int max_picture_px = 1600;           ///< longer side at which features are sought
  int max_features = 4096;
  double max_reproj_error_px = 4;
  bool loose = false;  ///< second attempt: fainter features, described for wide baselines, matched again along
                       ///< epipolar lines; fewer matches suffice. 3× slower
  int num_threads = 1;
  std::function<void(double fraction, const std::string& phase)> on_progress;
};

/// Two pictures to be matched, as named below the folder of pictures.
using PicturePair = std::pair<std::string, std::string>;

/// Structure from motion on the pictures below `pictures` (<camera>/<frame:06d>.png). work: an empty private folder.
/// Returns an empty model when no two pictures have enough in common. The outputs are checked, not the exit statuses,
/// which are 0 for some failures and not 0 for "no initial pair". Same pictures give slightly different results from
/// run to run: COLMAP's matcher uses randomised trees. Throws Error(Resource) when COLMAP is missing or runs out of
/// memory.
SparseModel run_colmap(const std::filesystem::path& pictures, const std::vector<PicturePair>& pairs,
                       const std::filesystem::path& work, const ColmapOptions& options);

}  // namespace vantage
