#include "jobs/correspond/fuse_flow.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <opencv2/ximgproc/edge_filter.hpp>

#include "jobs/correspond/census.h"

namespace vantage {
namespace {

/// Motion that does not come back costs this many bits more: a good match still wins over a consistent bad one.
constexpr float kInconsistentBits = 10;
/// Matches worse than this are as good as none (chance is 31), so one outlier does not outvote its neighbours.
constexpr float kWorstBits = 26;
constexpr int kSupportRadius_px = 3;
constexpr double kSupportEpsilon = 60;  ///< (8-bit grey levels)²: contrasts above about 8 part the votes

/// What it costs to say that motion is right, in census bits.
cv::Mat1f mismatch_bits(const cv::Mat1b& from, const Census& from_census, const cv::Mat1b& to, const cv::Mat2f& motion,
                        const cv::Mat2f& back, float consistent_px) {
  const cv::Mat1b warped = warp_back(to, motion, cv::INTER_LINEAR);
  cv::Mat1f cost = census_distance(from_census, census_transform(warped));
  cv::min(cost, kWorstBits, cost);
  const cv::Mat1f round_trip = round_trip_px(motion, back);
  cost.setTo(kWorstBits, round_trip == kOutOfFrame_px);
  cv::Mat1f inconsistent;
  cv::Mat(round_trip > consistent_px).convertTo(inconsistent, CV_32F, kInconsistentBits / 255.0);
  cost += inconsistent;
  cv::Mat1f smooth;
  cv::ximgproc::guidedFilter(from, cost, smooth, kSupportRadius_px, kSupportEpsilon);
  return smooth;
}

cv::Mat2f choose(const cv::Mat1b& from, const cv::Mat1b& to, const cv::Mat2f& predicted,
                 const cv::Mat2f& predicted_back, const cv::Mat2f& searched, const cv::Mat2f& searched_back,
                 const FuseOptions& options) {
  const Census census = census_transform(from);
  const cv::Mat1f cost_predicted = mismatch_bits(from, census, to, predicted, predicted_back, options.consistent_px);
  const cv::Mat1f cost_searched = mismatch_bits(from, census, to, searched, searched_back, options.consistent_px);
  cv::Mat take_searched = cost_searched + options.preference_bits < cost_predicted;
  cv::medianBlur(take_searched, take_searched, 5);
  cv::Mat2f motion = predicted.clone();
  searched.copyTo(motion, take_searched);
  return motion;
}

}  // namespace

FlowPair fuse_flows(const cv::Mat1b& a, const cv::Mat1b& b, const FlowPair& predicted, const FlowPair& searched,
                    const FuseOptions& options) {
  return {choose(a, b, predicted.a_to_b, predicted.b_to_a, searched.a_to_b, searched.b_to_a, options),
          choose(b, a, predicted.b_to_a, predicted.a_to_b, searched.b_to_a, searched.a_to_b, options)};
}

}  // namespace vantage
