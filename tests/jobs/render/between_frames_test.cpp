/// Slow motion: views between two frames of one camera, from where it stands.
#include <gtest/gtest.h>

#include <cmath>

#include "jobs/render/render_view.h"
#include "jobs/vision/colour_space.h"

namespace vantage {
namespace {

constexpr int kWidth = 160, kHeight = 90, kBall_px = 24, kStep_px = 30, kMargin_px = 20;
const Pinhole kPinhole{kWidth, kHeight, 150, 150, kWidth / 2.0, kHeight / 2.0};

/// A ball before a wall, its left end at left_px.
bool on_ball(int x, int y, int left_px) {
  const double radius = kBall_px / 2.0;
  return std::hypot(x + 0.5 - left_px - radius, y + 0.5 - kHeight / 2.0) < radius;
}

cv::Mat3b picture(int left_px) {
  cv::Mat3b bgr(kHeight, kWidth);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double wall = 70 + 30 * std::sin(0.3 * x) * std::cos(0.25 * y);
      const double ball = 210 + 30 * std::sin(0.5 * (x - left_px)) * std::cos(0.5 * y);
      const auto level = static_cast<uchar>(on_ball(x, y, left_px) ? ball : wall);
      bgr(y, x) = {level, level, level};
    }
  return bgr;
}

/// The true map; what the other frame hides has its surface's motion and no confidence.
FlowMap map_between(int from_px, int to_px) {
  FlowMap flow{cv::Mat2f(kHeight, kWidth), cv::Mat1f(kHeight, kWidth)};
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool ball = on_ball(x, y, from_px);
      flow.motion_px(y, x) = {ball ? static_cast<float>(to_px - from_px) : 0.0F, 0.0F};
      flow.confidence(y, x) = !ball && on_ball(x, y, to_px) ? 0.0F : 1.0F;
    }
  return flow;
}

SourceImage frame(int index, int left_px, float ball_z) {
  DepthMap depth{cv::Mat1f(kHeight, kWidth, 5.0F), cv::Mat1f(kHeight, kWidth, 1.0F)};
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      if (on_ball(x, y, left_px)) depth.z(y, x) = ball_z;
  return {{"cam", index}, 0.04 * index, kPinhole, {}, linear_from_srgb(picture(left_px)), depth, {}};
}

/// PSNR of the view halfway, depth of the ball as it is believed to be in either frame.
double halfway_db(float first_z, float second_z) {
  std::vector<SourceImage> images{frame(0, kMargin_px, first_z), frame(1, kMargin_px + kStep_px, second_z)};
  images[0].flows[1] = map_between(kMargin_px, kMargin_px + kStep_px);
  images[1].flows[0] = map_between(kMargin_px + kStep_px, kMargin_px);
  FramePlan plan;
  plan.images = {{images[0].id, images[0].time_s}, {images[1].id, images[1].time_s}};
  plan.method = "auto";
  plan.time_s = 0.02;
  plan.scene_distance = 5;
  PlannedEye eye;
  eye.pinhole = kPinhole;
  eye.mu = eye.share = {0.5, 0.5};
  const cv::Mat3b drawn = srgb8_from_linear(render_eye(images, plan, eye).bgr);
  return cv::PSNR(drawn, picture(kMargin_px + kStep_px / 2));
}

TEST(BetweenFrames, WhatMovesLeavesNoGhost) { EXPECT_GE(halfway_db(3, 3), 36); }

TEST(BetweenFrames, WrongDepthOfWhatMovesDoesNotMatter) {
  EXPECT_GE(halfway_db(7, 7), 36);  // behind the wall
  EXPECT_GE(halfway_db(3, 4), 36);
  EXPECT_GE(halfway_db(6, 3), 36);
}

}  // namespace
}  // namespace vantage
