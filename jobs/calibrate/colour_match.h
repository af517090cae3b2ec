#pragma once
#include <vector>

#include "jobs/calibrate/known.h"
#include "jobs/job_context.h"
#include "schema/formats/calibration.h"

namespace vantage {

/// Compares the cameras' colours where they see the same and, when they differ, publishes colour.json
/// (schema/formats/colour.h). One curve per camera for all of its footage: an exposure that changes over time stays.
/// Needs the cameras' "ingest/<camera>". Figures: colour_gain_max_percent, colour_residual_percent; a warning names
/// cameras that could not be compared.
void match_colour(JobContext& context, const Calibration& calibration, const std::vector<FilmedCamera>& cameras);

}  // namespace vantage
