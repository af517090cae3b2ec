#pragma once
#include <opencv2/core.hpp>

#include "schema/formats/navspace.h"

namespace vantage {

/// Map of a navigation space for people: the cameras seen from the front (azimuth to the right, elevation up) above the
/// images over time (azimuth to the right, time down). 480 px wide.
cv::Mat navspace_picture(const Navspace& navspace);

}  // namespace vantage
