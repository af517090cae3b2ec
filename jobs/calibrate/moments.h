#pragma once
#include <optional>
#include <vector>

#include "jobs/calibrate/plate.h"
#include "jobs/calibrate/survey.h"

namespace vantage {

/// Shot times at which the cameras with a known clock are looked at: at most max_moments frame times of theirs, spread
/// evenly over the time that at least two of them film. Rising; empty when fewer than two static cameras have a clock.
std::vector<double> choose_moments(const std::vector<FilmedCamera>& cameras, int max_moments);

/// The frame nearest to a shot time; empty when the camera did not film then, or its clock is not known.
std::optional<int> frame_near(const FilmedCamera& camera, double time_s);

/// What moves in a static camera's picture at a moment. Features are found in the nearest frame and carried to the
/// moment along the way that each goes to the next frame on the other side (Lucas & Kanade 1981, forth and back):
/// half a frame of a running person is several pixels. Those that cannot be followed are dropped.
/// Empty when the camera did not film then.
std::optional<Survey::Glimpse> glimpse_of_motion(const FilmedCamera& camera, const Plate& plate, int moment,
                                                 double time_s, const Footage& footage, const FeatureOptions& options);

}  // namespace vantage
