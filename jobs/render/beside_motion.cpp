#include "jobs/render/beside_motion.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace vantage {
namespace {

constexpr float kSmooth_px = 0.5F, kBoundary_px = 1.5F;  ///< motions that differ by less, and by more, within 2 px
constexpr int kReach_px = 2;
constexpr float kBeside = 0.1F;

/// Largest less smallest value within radius px.
cv::Mat1f range_within(const cv::Mat1f& values, int radius) {
  const cv::Mat around = cv::Mat::ones(2 * radius + 1, 2 * radius + 1, CV_8U);
  cv::Mat1f largest, smallest, range;
  cv::dilate(values, largest, around);
  cv::erode(values, smallest, around);
  cv::subtract(largest, smallest, range);
  return range;
}

}  // namespace

cv::Mat1f worth_beside_motion(const cv::Mat2f& motion_px) {
  std::vector<cv::Mat1f> uv;
  cv::split(motion_px, uv);
  cv::Mat1f worth = range_within(uv[0], kReach_px);
  const cv::Mat1f down = range_within(uv[1], kReach_px);
  for (int y = 0; y < worth.rows; ++y)
    for (int x = 0; x < worth.cols; ++x) {
      const float apart = std::max(worth(y, x), down(y, x));
      const float over = std::clamp((apart - kSmooth_px) / (kBoundary_px - kSmooth_px), 0.0F, 1.0F);
      worth(y, x) = 1 - (1 - kBeside) * over;
    }
  return worth;
}

}  // namespace vantage
