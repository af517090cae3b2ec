#pragma once
#include <vector>

#include "jobs/views/disparity_knots.h"

namespace vantage {

/// What a frame with two eyes is told besides its cameras.
struct StereoPlan {
  StereoRig rig;
  DisparityMapping mapping;          ///< of eyes that are displaced: none
  std::vector<DisparityKnot> knots;  ///< when the mapping needs the scene
  double floating_window_percent = 0;
};

Json to_json(const StereoPlan& plan);
StereoPlan stereo_plan_from(const Json& json);

}  // namespace vantage
