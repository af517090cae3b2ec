#pragma once
#include <opencv2/core.hpp>

#include "jobs/correspond/free_flow.h"

namespace vantage {

/// Motion between two frames of one camera that did not move: exactly (0, 0) wherever that explains the pictures as
/// well as the motion that free_flow finds, up to the sensor's noise. Pixels that something moved into count as still
/// background; pixels that nothing explains keep a motion that does not come back. Contract as of free_flow.
FlowPair still_camera_flow(const cv::Mat1b& a, const cv::Mat1b& b, const FreeFlowOptions& options);

}  // namespace vantage
