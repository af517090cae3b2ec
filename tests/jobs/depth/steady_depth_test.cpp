#include "jobs/depth/steady_depth.h"

#include <gtest/gtest.h>

#include <vector>

namespace vantage {
namespace {

constexpr double kAgreement = 0.005;

DepthMap flat(float z, float confidence) { return {cv::Mat1f(12, 16, z), cv::Mat1f(12, 16, confidence)}; }
FlowMap moved_by(float x_px) { return {cv::Mat2f(12, 16, cv::Vec2f(x_px, 0)), cv::Mat1f(12, 16, 1.0F)}; }
const Pinhole kPinhole{16, 12, 20, 20, 8, 6};

TEST(SteadyDepth, AMomentsOutlierIsOutvotedByTheFramesAround) {
  const std::vector around{flat(4.0F, 1), flat(4.004F, 1)};
  const DepthMap steady = steady_depth(flat(6.0F, 1), around, kAgreement);
  EXPECT_NEAR(steady.z(5, 5), 4.002, 1e-3);
  EXPECT_NEAR(steady.confidence(5, 5), 2.0 / 3, 1e-3);
}

TEST(SteadyDepth, WhatComesNearerStaysWhereItIs) {
  const std::vector around{flat(4.3F, 1), flat(3.7F, 1)};
  const DepthMap steady = steady_depth(flat(4.0F, 1), around, kAgreement);
  EXPECT_NEAR(steady.z(5, 5), 4, 1e-4);
  EXPECT_FLOAT_EQ(steady.confidence(5, 5), 1);
}

TEST(SteadyDepth, AGapIsHeardFromTheFramesAround) {
  const std::vector around{flat(4.0F, 0.5F)};
  const DepthMap steady = steady_depth(flat(0.0F, 0), around, kAgreement);
  EXPECT_NEAR(steady.z(5, 5), 4, 1e-4);
  EXPECT_NEAR(steady.confidence(5, 5), 0.5, 1e-4);
}

TEST(SteadyDepth, NothingKnownStaysUnknown) {
  const DepthMap steady = steady_depth(flat(0.0F, 0), std::vector{flat(0.0F, 0)}, kAgreement);
  EXPECT_EQ(cv::countNonZero(steady.z), 0);
}

TEST(CarriedDepth, GoesAlongTheMotion) {
  DepthFrame frame{flat(4.0F, 1), {}, moved_by(3)};
  frame.depth.z(6, 10) = 2;
  const DepthMap carried = carried_depth(frame, kPinhole, {});
  EXPECT_FLOAT_EQ(carried.z(6, 7), 2);
  EXPECT_FLOAT_EQ(carried.z(6, 10), 4);
  EXPECT_EQ(carried.confidence(6, 14), 0) << "outside the frame";
}

TEST(CarriedDepth, OfAMovingCameraIsToldInTheImagesPose) {
  DepthFrame frame{flat(4.0F, 1), {}, moved_by(0)};
  RigidTransform ahead;
  ahead.t.z() = -0.5;  // the image was taken half a unit further on
  EXPECT_FLOAT_EQ(carried_depth(frame, kPinhole, ahead).z(6, 8), 3.5);
}

}  // namespace
}  // namespace vantage
