#include "jobs/correspond/fill_hidden.h"

#include <vector>

#include "jobs/correspond/interpolate_matches.h"

namespace vantage {
namespace {

constexpr int kSpacing_px = 3;  ///< between consistent pixels that motion is taken from
/// Hidden areas are wide: more matches from farther away than between seeds, and edges that part more strictly.
constexpr InterpolationOptions kAcross{.num_neighbours = 150, .edge_contrast = 4, .reach = 24};

cv::Mat2f filled(const cv::Mat1f& grey, const cv::Mat2f& motion, const cv::Mat1f& consistent) {
  std::vector<SparseMatch> matches;
  for (int y = kSpacing_px / 2; y < motion.rows; y += kSpacing_px)
    for (int x = kSpacing_px / 2; x < motion.cols; x += kSpacing_px)
      if (consistent(y, x) > 0) matches.push_back({{x, y}, cv::Point2f(motion(y, x))});
  if (matches.empty()) return motion;
  cv::Mat2f out = interpolate_matches(grey, matches, kAcross);
  motion.copyTo(out, consistent > 0);
  return out;
}

}  // namespace

cv::Mat1f comes_back(const cv::Mat2f& forward, const cv::Mat2f& backward) {
  cv::Mat1f trust;
  cv::Mat(round_trip_px(forward, backward) < kHiddenRoundTrip_px).convertTo(trust, CV_32F, 1 / 255.0);
  return trust;
}

void fill_hidden(const cv::Mat1f& a, const cv::Mat1f& b, FlowPair& flow) {
  flow = {filled(a, flow.a_to_b, comes_back(flow.a_to_b, flow.b_to_a)),
          filled(b, flow.b_to_a, comes_back(flow.b_to_a, flow.a_to_b))};
}

}  // namespace vantage
