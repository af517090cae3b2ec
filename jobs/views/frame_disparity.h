#pragma once
#include <filesystem>

#include "schema/base/json.h"

namespace vantage {

/// What a viewer of one stereo frame has to bear: disparities of all known pixels of both eyes, after mapping, in % of
/// the picture's width. As people of the trade say it: negative in front of the screen, positive behind it.
struct FrameDisparity {
  double nearest_percent = 0, farthest_percent = 0;                                              ///< least and greatest
  double p0_1_percent = 0, p5_percent = 0, p50_percent = 0, p95_percent = 0, p99_9_percent = 0;  ///< percentiles
  double too_near_share = 0, too_far_share = 0;  ///< of the known pixels, 0–1: outside the depth budget
  /// Things in front of the picture's frame that it cuts off: share of the left border's height, in the left eye, and
  /// of the right border's, in the right eye; and how far in front they are (95 % of them less), ≥ 0.
  double cut_left_share = 0, cut_right_share = 0, cut_percent = 0;
};

/// disparity.json beside a stereo frame.
void write_frame_disparity(const std::filesystem::path& file, const FrameDisparity& disparity);
FrameDisparity read_frame_disparity(const std::filesystem::path& file);

/// All members, in the order above, as one object.
Json to_json(const FrameDisparity& disparity);

}  // namespace vantage
