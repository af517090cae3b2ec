#include "jobs/track/motion_recorder.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <random>

namespace vantage::track {
namespace {

/// A bright square on grey noise, its left edge at x.
cv::Mat3b picture(int x, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1.5);
  cv::Mat3b out(90, 160);
  for (auto& px : out)
    for (int c = 0; c < 3; ++c) px[c] = cv::saturate_cast<uchar>(90 + noise(random));
  cv::rectangle(out, {x, 30, 20, 20}, {40, 60, 200}, cv::FILLED);
  return out;
}

TEST(MotionRecorder, SeesTheThingWhereItIsAndNotWhereItWasOrWillBe) {
  MotionRecorder recorder("cam", 30);
  for (int f = 0; f < 5; ++f) recorder.add(picture(20 + 25 * f, static_cast<unsigned>(f)));
  const MovingAreas areas = recorder.finish();
  ASSERT_EQ(areas.frames.size(), 5U);
  EXPECT_EQ(areas.cell_px, 1);
  EXPECT_TRUE(areas.frames.front().empty() && areas.frames.back().empty()) << "what they hold is not known";
  for (std::size_t f = 1; f < 4; ++f) {
    int num = 0;
    for (const MovingRun& run : areas.frames[f]) {
      EXPECT_GE(run.begin, 20 + 25 * static_cast<int>(f) - 3);
      EXPECT_LE(run.end, 40 + 25 * static_cast<int>(f) + 3);
      num += run.end - run.begin;
    }
    EXPECT_NEAR(num, 400, 120) << "frame " << f;
  }
}

TEST(MotionRecorder, StillSceneHasNoMotion) {
  MotionRecorder recorder("cam", 30);
  for (unsigned f = 0; f < 4; ++f) recorder.add(picture(50, f));
  for (const auto& runs : recorder.finish().frames) EXPECT_TRUE(runs.empty());
}

TEST(MotionRecorder, WhatIsMaskedDoesNotMove) {
  cv::Mat1b counts(90, 160, uchar{255});
  counts.rowRange(0, 40).setTo(0);
  MotionRecorder recorder("cam", 30);
  for (int f = 0; f < 3; ++f) recorder.add(picture(20 + 25 * f, static_cast<unsigned>(f)), counts);
  const MovingAreas areas = recorder.finish();
  ASSERT_FALSE(areas.frames[1].empty());
  for (const MovingRun& run : areas.frames[1]) EXPECT_GE(run.row, 40);
}

TEST(MotionRecorder, FastFootageIsComparedOverAThirtiethOfASecond) {
  MotionRecorder recorder("cam", 120);
  for (int f = 0; f < 12; ++f) recorder.add(picture(20 + 6 * f, static_cast<unsigned>(f)));
  const MovingAreas areas = recorder.finish();
  EXPECT_TRUE(areas.frames[3].empty());
  EXPECT_FALSE(areas.frames[4].empty());
  EXPECT_FALSE(areas.frames[7].empty());
  EXPECT_TRUE(areas.frames[8].empty());
}

}  // namespace
}  // namespace vantage::track
