#pragma once
/// Correspondences of a scene taken to be static, from plane sweeps both ways.
#include <opencv2/core.hpp>

#include "jobs/correspond/flow_pair.h"
#include "jobs/correspond/posed_picture.h"

namespace vantage {

struct StereoOptions {
  int max_pixels = 600'000;  ///< larger pictures are matched at half, quarter… size
  int max_labels = 384;      ///< inverse depths tried
};

/// Along epipolar lines both ways, pixels without a consistent match filled from the farther of their neighbours.
/// False when the views have no parallax to speak of: then `flow` is untouched.
bool stereo_flow(const PosedPicture& a, const PosedPicture& b, const StereoOptions& options, FlowPair& flow);

}  // namespace vantage
