#include "jobs/correspond/still_camera_flow.h"

#include <gtest/gtest.h>

#include "tests/jobs/correspond/moving_layers.h"

namespace vantage {
namespace {

using synthetic::LayeredPair;
using synthetic::render_layers;

/// A background that stands still behind a disc that moves.
LayeredPair passing_disc(cv::Vec2d motion_px, double noise_grey) {
  return render_layers({320, 180}, {{{160, 90}, 0, {0, 0}, 0}, {{120, 90}, 35, motion_px, 0.03}}, noise_grey);
}

double share(const cv::Mat& of, const cv::Mat& within) {
  const cv::Mat both = of & within;
  return static_cast<double>(cv::countNonZero(both)) / cv::countNonZero(within);
}
cv::Mat still(const cv::Mat2f& motion) {
  cv::Mat1b out(motion.size());
  for (int y = 0; y < motion.rows; ++y)
    for (int x = 0; x < motion.cols; ++x) out(y, x) = motion(y, x) == cv::Vec2f(0, 0) ? 255 : 0;
  return out;
}

TEST(StillCameraFlow, BackgroundIsExactlyStillInSpiteOfNoise) {
  for (const double noise_grey : {0.0, 2.0, 6.0}) {
    const LayeredPair pair = passing_disc({8, 3}, noise_grey);
    const FlowPair flow = still_camera_flow(pair.a, pair.b, {});
    const cv::Mat background = (pair.layer == 0) & pair.visible;
    EXPECT_GT(share(still(flow.a_to_b), background), 0.985) << noise_grey;
  }
}

TEST(StillCameraFlow, WhatMovesKeepsItsMotion) {
  for (const double step_px : {0.8, 4.0, 30.0}) {
    const LayeredPair pair = passing_disc({step_px, 0.2 * step_px}, 2);
    const FlowPair flow = still_camera_flow(pair.a, pair.b, {});
    int num_right = 0, num = 0;
    for (int y = 0; y < pair.a.rows; ++y)
      for (int x = 0; x < pair.a.cols; ++x)
        if (pair.layer(y, x) == 1 && pair.visible(y, x))
          num_right += cv::norm(flow.a_to_b(y, x) - pair.a_to_b(y, x)) < 0.5, ++num;
    EXPECT_GT(num_right, 0.9 * num) << step_px;
  }
}

TEST(StillCameraFlow, BackgroundThatSomethingMovedInFrontOfDoesNotComeBack) {
  const LayeredPair pair = passing_disc({25, 0}, 2);
  const FlowPair flow = still_camera_flow(pair.a, pair.b, {});
  const cv::Mat1f loop = round_trip_px(flow.a_to_b, flow.b_to_a);
  const cv::Mat hidden = (pair.layer == 0) & (pair.visible == 0), lost = loop > 1.5;
  EXPECT_GT(share(lost, hidden), 0.85);
  EXPECT_GT(share(still(flow.a_to_b), hidden), 0.7) << "it is the background's motion all the same";
  EXPECT_LT(share(lost, pair.visible), 0.03);
}

}  // namespace
}  // namespace vantage
