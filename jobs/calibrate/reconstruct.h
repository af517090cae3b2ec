#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "jobs/calibrate/calibrate_job.h"
#include "jobs/calibrate/picture_pair.h"
#include "jobs/calibrate/sparse_model.h"
#include "jobs/calibrate/survey.h"

namespace vantage {

struct Reconstruction {
  SparseModel model;  ///< without the cameras that could not be placed; empty: none could
  struct {
    std::string a, b;  ///< cameras
    std::size_t num_matches = 0;
  } best_pair;  ///< the two cameras that have most in common
};

/// Structure from motion: features, matches of all pairs, COLMAP's mapper. When a camera is missing a second attempt
/// takes fainter features and looser terms; the one that places more counts. The same pictures give the same result.
Reconstruction reconstruct(const std::vector<FilmedCamera>& cameras, const Footage& footage,
                           const CalibrateJob::Params& params, const std::filesystem::path& work, int num_threads,
                           const std::function<void(double fraction, const std::string& phase)>& on_progress);

}  // namespace vantage
