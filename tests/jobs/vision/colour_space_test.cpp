#include "jobs/vision/colour_space.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vantage {
namespace {

TEST(ColourSpace, EveryLevelOf8And16BitsComesBack) {
  cv::Mat3b levels(1, 256);
  for (int k = 0; k < 256; ++k) levels(0, k) = cv::Vec3b::all(static_cast<uchar>(k));
  EXPECT_EQ(cv::norm(levels, srgb8_from_linear(linear_from_srgb(levels)), cv::NORM_INF), 0);
  cv::Mat3w deep(1, 65536);
  for (int k = 0; k < 65536; ++k) deep(0, k) = cv::Vec3w::all(static_cast<ushort>(k));
  EXPECT_EQ(cv::norm(deep, srgb16_from_linear(linear_from_srgb(deep)), cv::NORM_INF), 0);
}

TEST(ColourSpace, TablesAndExactFunctionsAgree) {
  for (int k = 0; k <= 5000; ++k) {
    const float linear = static_cast<float>(k) / 5000;
    const float exact = 65535 * srgb_from_linear(linear);
    EXPECT_NEAR(srgb16_from_linear(cv::Mat3f(1, 1, cv::Vec3f::all(linear)))(0, 0)[1], exact, 0.5 + 0.25) << linear;
    EXPECT_NEAR(linear_from_srgb(srgb_from_linear(linear)), linear, 2e-6);
  }
}

TEST(ColourSpace, HalfTheLightIsLevel188AndValuesOutsideAreClamped) {
  const cv::Mat3b level = srgb8_from_linear(cv::Mat3f(1, 1, cv::Vec3f(0.5F, -1, 3)));
  EXPECT_EQ(level(0, 0), cv::Vec3b(188, 0, 255));
}

}  // namespace
}  // namespace vantage
