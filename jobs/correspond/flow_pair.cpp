#include "jobs/correspond/flow_pair.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace vantage {
namespace {

/// Array indices x + motion(x); motion needs no half-pixel shift, being a difference.
cv::Mat2f end_points(const cv::Mat2f& motion) {
  cv::Mat2f ends(motion.size());
  for (int y = 0; y < motion.rows; ++y)
    for (int x = 0; x < motion.cols; ++x)
      ends(y, x) = motion(y, x) + cv::Vec2f(static_cast<float>(x), static_cast<float>(y));
  return ends;
}

}  // namespace

cv::Mat warp_back(const cv::Mat& picture, const cv::Mat2f& motion, int interpolation) {
  cv::Mat warped;
  cv::remap(picture, warped, end_points(motion), cv::noArray(), interpolation, cv::BORDER_REPLICATE);
  return warped;
}

cv::Mat1f round_trip_px(const cv::Mat2f& forward, const cv::Mat2f& backward) {
  const cv::Mat2f back = warp_back(backward, forward, cv::INTER_LINEAR);
  cv::Mat1f error(forward.size());
  for (int y = 0; y < forward.rows; ++y)
    for (int x = 0; x < forward.cols; ++x) {
      const cv::Vec2f m = forward(y, x), end = m + cv::Vec2f(static_cast<float>(x), static_cast<float>(y));
      const bool inside = end[0] > -0.5F && end[1] > -0.5F && end[0] < static_cast<float>(backward.cols) - 0.5F &&
                          end[1] < static_cast<float>(backward.rows) - 0.5F;
      error(y, x) =
          inside ? static_cast<float>(std::hypot(m[0] + back(y, x)[0], m[1] + back(y, x)[1])) : kOutOfFrame_px;
    }
  return error;
}

}  // namespace vantage
