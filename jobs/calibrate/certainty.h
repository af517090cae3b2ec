#pragma once
#include <map>
#include <string>

#include "jobs/calibrate/bundle.h"

namespace vantage {

/// Standard deviations of what was estimated, as the measurements' own scatter tells them. They hold what chance does;
/// features that wander together, and lenses that no model describes, come on top.
struct CameraCertainty {
  double centre_std = 0;         ///< of the distance from the true place, in the model's units
  double rotation_std_deg = 0;   ///< of the angle to the true orientation
  double focal_std_percent = 0;  ///< of the focal length
};

/// By picture. The world that these errors are measured in is the one that suits all camera centres best (a similarity
/// transform: no picture tells it), so that they can be compared with aligned truth. From the normal equations with the
/// points eliminated (Triggs et al. 2000, §6.1 and §9), at the bundle's optimum. Empty when there are too many pictures
/// for that (over 250), or too few measurements.
std::map<ImageId, CameraCertainty> certainty_of(SparseModel& model, const LensFreedom& freedom);

}  // namespace vantage
