#pragma once
#include <map>
#include <string>

#include "jobs/align/joint_scene.h"
#include "jobs/job_context.h"
#include "schema/formats/clocks.h"

namespace vantage::align {

/// The static calibrated cameras among those that the clocks know, with what they see, from the artifacts of track,
/// sync and calibrate, and of estimated cameras the background. No points when the clocks' reference is not among them.
/// readout_ms: of every static camera's rows, by name.
JointScene read_joint_scene(const JobContext& context, const Clocks& clocks,
                            const std::map<std::string, double>& readout_ms, bool known_cameras);

}  // namespace vantage::align
