#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "jobs/calibrate/bundle.h"
#include "jobs/calibrate/calibrate_job.h"
#include "jobs/calibrate/gauge.h"
#include "jobs/calibrate/certainty.h"
#include "jobs/calibrate/known.h"
#include "jobs/calibrate/survey.h"
#include "schema/formats/calibration.h"
#include "schema/formats/observations.h"

namespace vantage {

/// Calibration from pictures: survey, COLMAP, bundle adjustment, a pose for every frame, world (gauge.h).
struct EstimatedCalibration {
  Calibration calibration;
  std::vector<PointObservation> observations;    ///< of calibration.points
  std::map<ImageId, CameraCertainty> certainty;  ///< of the pictures that were calibrated together; in world units
  BundleReport bundle;
  WorldFacts world;
  std::vector<std::string> warnings;  ///< sentences
};

/// Cameras that could not be placed are left out with a warning. work: an empty private folder.
/// Throws Error(BadInput) when fewer than two can be placed.
EstimatedCalibration estimate_calibration(
    const std::vector<FilmedCamera>& cameras, const Footage& footage, const CalibrateJob::Params& params,
    const std::filesystem::path& work, int num_threads,
    const std::function<void(double fraction, const std::string& phase)>& on_progress);

}  // namespace vantage
