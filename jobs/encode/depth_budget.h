#pragma once
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "jobs/views/disparity_curve.h"
#include "jobs/views/frame_disparity.h"

namespace vantage {

/// A frame of a stereo film.
struct BudgetFrame {
  int frame = 0;
  FrameDisparity disparity;
};

/// The frames as a table, and what holds for the whole film.
Json depth_budget_table(const std::vector<BudgetFrame>& frames, const DepthBudget& budget);

/// Chart of a film: over the frames from left to right the range of disparity (99.8 % of the pixels light, 90 % dark,
/// the median a line), the budget as a band, in % of the width, what is in front of the screen at the top; frames
/// outside the budget in red.
cv::Mat3b depth_budget_chart(const std::vector<BudgetFrame>& frames, const DepthBudget& budget);

/// Sentences about what would trouble a viewer, with the frames and what to change; none when all is well. A frame
/// leaves the budget when more than 0.1 % of its pixels do; things are cut off by the picture's frame when they are
/// in front of more than a tenth of a border.
std::vector<std::string> depth_budget_warnings(const std::vector<BudgetFrame>& frames, const DepthBudget& budget);

}  // namespace vantage
