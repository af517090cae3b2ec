#include "jobs/correspond/still_camera_flow.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <opencv2/ximgproc/edge_filter.hpp>
#include <vector>

#include "jobs/correspond/fill_hidden.h"

namespace vantage {
namespace {

/// Warping averages up to four noisy pixels, which lowers the mean difference of two frames by up to 0.17 of its
/// deviation: a small motion must explain twice as much more. One of a pixel or longer is rarely made up; flat areas do
/// not speak against it, so stillness must explain more than it does.
float margin(double motion_px) {
  constexpr double kOfNone = 0.35, kOfOnePixel = -0.1;
  return static_cast<float>(kOfNone + (kOfOnePixel - kOfNone) * std::min(1.0, motion_px));
}

/// Differences beyond this many deviations are all equally bad.
constexpr float kWorst = 6;
/// Neighbours of like grey decide together; two levels as in fuse_flows, and wider, since flat areas do not know.
constexpr int kSupportRadius_px = 6;
constexpr double kSupportEpsilon = 60;
/// Shorter motion is no motion.
constexpr double kShortest_px = 0.05;

/// Standard deviation of a - b over pixels that did not move, which are most; at least that of rounding.
float noise_of(const cv::Mat1b& a, const cv::Mat1b& b) {
  cv::Mat1b difference;
  cv::absdiff(a, b, difference);
  std::vector<int> counts(256, 0);
  for (const uchar value : difference) ++counts[value];
  std::size_t value = 0;
  for (std::size_t sum = 0; value < 255; ++value)
    if ((sum += static_cast<std::size_t>(counts[value])) * 2 >= difference.total()) break;
  return std::max(0.5F, 1.4826F * static_cast<float>(value));
}

/// |from - to(x + motion)| in deviations of the noise, averaged over like neighbours.
cv::Mat1f misfit(const cv::Mat1b& from, const cv::Mat1b& warped, float noise) {
  cv::Mat1f difference, smooth;
  cv::Mat absolute;
  cv::absdiff(from, warped, absolute);
  absolute.convertTo(difference, CV_32F, 1 / noise);
  cv::min(difference, kWorst, difference);
  cv::ximgproc::guidedFilter(from, difference, smooth, kSupportRadius_px, kSupportEpsilon);
  return smooth;
}

/// Where nothing moved, or what was there is now hidden by something that did.
cv::Mat1b still_of(const cv::Mat1b& from, const cv::Mat1b& to, const cv::Mat2f& motion, const cv::Mat2f& back,
                   float noise) {
  const cv::Mat1f misfit_still = misfit(from, to, noise),
                  misfit_moved = misfit(from, warp_back(to, motion, cv::INTER_LINEAR), noise);
  const cv::Mat1f trust = comes_back(motion, back), back_trust = comes_back(back, motion);
  cv::Mat1b still(from.size());
  for (int y = 0; y < from.rows; ++y)
    for (int x = 0; x < from.cols; ++x) {
      const double motion_px = cv::norm(motion(y, x));
      const bool fits = misfit_still(y, x) <= misfit_moved(y, x) + margin(motion_px);
      const bool hidden = trust(y, x) == 0 && back_trust(y, x) > 0 && cv::norm(back(y, x)) > kHiddenRoundTrip_px;
      still(y, x) = fits || hidden || motion_px < kShortest_px ? 255 : 0;
    }
  cv::medianBlur(still, still, 5);
  return still;
}

}  // namespace

FlowPair still_camera_flow(const cv::Mat1b& a, const cv::Mat1b& b, const FreeFlowOptions& options) {
  FlowPair flow = free_flow(a, b, options);
  const float noise = noise_of(a, b);
  const cv::Mat1b still_a = still_of(a, b, flow.a_to_b, flow.b_to_a, noise),
                  still_b = still_of(b, a, flow.b_to_a, flow.a_to_b, noise);
  flow.a_to_b.setTo(cv::Scalar(0, 0), still_a);
  flow.b_to_a.setTo(cv::Scalar(0, 0), still_b);
  return flow;
}

}  // namespace vantage
