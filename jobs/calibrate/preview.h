#pragma once
#include <opencv2/core.hpp>

#include "schema/formats/calibration.h"

namespace vantage {

/// Cameras and points seen from above, 480x360: what a person looks at to see whether a calibration is right.
cv::Mat top_view(const Calibration& calibration);

}  // namespace vantage
