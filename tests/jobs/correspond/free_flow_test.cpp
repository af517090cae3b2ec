#include "jobs/correspond/free_flow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/jobs/correspond/moving_layers.h"

namespace vantage {
namespace {

using synthetic::LayeredPair;
using synthetic::render_layers;

/// Mean length of the error over marked pixels that both pictures show.
double mean_error_px(const cv::Mat2f& motion, const LayeredPair& truth, const cv::Mat1b& of) {
  double sum = 0;
  int num = 0;
  for (int y = 0; y < motion.rows; ++y)
    for (int x = 0; x < motion.cols; ++x)
      if (truth.visible(y, x) && of(y, x)) sum += cv::norm(motion(y, x) - truth.a_to_b(y, x)), ++num;
  return sum / std::max(1, num);
}

/// Share of those pixels within 1 px of the truth.
double right_percent(const cv::Mat2f& motion, const LayeredPair& truth, const cv::Mat1b& of) {
  int num_right = 0, num = 0;
  for (int y = 0; y < motion.rows; ++y)
    for (int x = 0; x < motion.cols; ++x)
      if (truth.visible(y, x) && of(y, x)) num_right += cv::norm(motion(y, x) - truth.a_to_b(y, x)) < 1, ++num;
  return 100.0 * num_right / std::max(1, num);
}

cv::Mat1b in_layer(const LayeredPair& pair, int layer) {
  const cv::Mat marked = pair.layer == layer;
  return marked;
}

TEST(FreeFlow, SmallMotionIsFoundToAFractionOfAPixel) {
  const LayeredPair pair =
      render_layers({240, 160}, {{{120, 80}, 0, {0.37, -0.21}, 0.002}, {{100, 80}, 40, {2.3, 1.4}, 0.03}});
  const FlowPair flow = free_flow(pair.a, pair.b, {});
  EXPECT_LT(mean_error_px(flow.a_to_b, pair, in_layer(pair, 0)), 0.1);
  EXPECT_LT(mean_error_px(flow.a_to_b, pair, in_layer(pair, 1)), 0.1);
}

TEST(FreeFlow, SmallThingsThatMovedFarAreFound) {
  const LayeredPair pair = render_layers({360, 200}, {{{180, 100}, 0, {1.5, 0.5}, 0}, {{110, 90}, 24, {120, 25}, 0.1}});
  const cv::Mat1b disc = in_layer(pair, 1);
  EXPECT_GT(right_percent(free_flow(pair.a, pair.b, {}).a_to_b, pair, disc), 75);
  EXPECT_LT(right_percent(free_flow(pair.a, pair.b, {.jumps = false}).a_to_b, pair, disc), 25)
      << "this motion shows nothing about jumps";
}

TEST(FreeFlow, BothWaysAgreeWherePixelsAreSeenTwice) {
  const LayeredPair pair = render_layers({240, 160}, {{{120, 80}, 0, {3, 1}, 0}, {{100, 80}, 40, {14, -4}, 0.05}});
  const FlowPair flow = free_flow(pair.a, pair.b, {});
  const cv::Mat1f loop = round_trip_px(flow.a_to_b, flow.b_to_a);
  const cv::Mat seen_once = (loop < 1) & pair.visible;
  EXPECT_GT(cv::countNonZero(seen_once), 0.97 * cv::countNonZero(pair.visible));
}

TEST(FreeFlow, LargePicturesAreSearchedSmallerAndStillHitThePixel) {
  const LayeredPair pair = render_layers({360, 200}, {{{180, 100}, 0, {1.3, 0.4}, 0}, {{150, 90}, 50, {-9, 5}, 0.03}});
  const FlowPair flow = free_flow(pair.a, pair.b, {.max_search_pixels = 20'000});
  EXPECT_LT(mean_error_px(flow.a_to_b, pair, pair.visible), 0.3);
}

TEST(FreeFlow, SameBytesOnEveryRunAndForAnyNumberOfThreads) {
  const LayeredPair pair = render_layers({200, 140}, {{{100, 70}, 0, {1.5, 0.5}, 0}, {{80, 70}, 15, {60, 10}, 0.1}});
  const int threads_before = cv::getNumThreads();
  cv::setNumThreads(1);
  const FlowPair one = free_flow(pair.a, pair.b, {});
  cv::setNumThreads(2);
  const FlowPair two = free_flow(pair.a, pair.b, {});
  cv::setNumThreads(threads_before);
  EXPECT_EQ(cv::norm(one.a_to_b, two.a_to_b, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(one.b_to_a, two.b_to_a, cv::NORM_INF), 0);
}

TEST(FreeFlow, PicturesWithoutTextureOrOfAFewPixelsGiveNoNonsense) {
  for (const cv::Size size : {cv::Size(1, 1), cv::Size(3, 40), cv::Size(64, 48)}) {
    const cv::Mat1b grey(size, uchar{90});
    const FlowPair flow = free_flow(grey, grey, {});
    EXPECT_EQ(flow.a_to_b.size(), size);
    EXPECT_LT(cv::norm(flow.a_to_b, cv::NORM_INF), 1e-3) << size;
  }
}

}  // namespace
}  // namespace vantage
