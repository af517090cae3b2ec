#pragma once
#include <opencv2/core.hpp>

namespace vantage {

/// How much the colours of pixels beside a motion boundary are worth, 0–1: the two pixels on either side of the
/// silhouette of what moves hold some of both colours (Zitnick et al. 2004, boundary mattes); those of the background
/// would stay behind as a ring where another frame shows the background clean. The surface that moves is the same in
/// both frames, there all of its rim counts less alike. motion_px: from pixels to another frame.
cv::Mat1f worth_beside_motion(const cv::Mat2f& motion_px);

}  // namespace vantage
