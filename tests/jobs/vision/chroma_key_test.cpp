#include "jobs/vision/chroma_key.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace vantage {
namespace {

const cv::Vec3f kGreen(0.08F, 0.5F, 0.06F);  // BGR, linear

/// A foreground with soft edges before an unevenly lit screen, exact.
struct Shot {
  cv::Mat3f picture, premultiplied;
  cv::Mat1f alpha;
};

/// A disc of skin and cloth with hair: strands that get thinner outwards, down to a third of a pixel.
float truth_alpha(double x, double y) {
  const double dx = x - 160, dy = y - 120, r = std::hypot(dx, dy), angle = std::atan2(dy, dx);
  const double disc = std::clamp((60 - r) / 3 + 0.5, 0.0, 1.0);
  const double strand_px = 2.5 * (1 - (r - 55) / 40), across_px = std::abs(std::sin(24 * angle)) * r / 24;
  const double hair = r > 55 && r < 95 && dy < 0 ? std::clamp(strand_px - across_px, 0.0, 1.0) : 0;
  return static_cast<float>(std::max(disc, hair));
}

Shot shot(float noise = 0) {
  Shot s{cv::Mat3f(240, 320), cv::Mat3f(240, 320), cv::Mat1f(240, 320)};
  std::mt19937 random(5);
  const auto uniform = [&] { return static_cast<float>(random()) / 4294967296.0F - 0.5F; };
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) {
      const cv::Vec3f colour = y < 120 ? cv::Vec3f(0.03F, 0.05F, 0.09F) : cv::Vec3f(0.3F, 0.35F, 0.6F);  // hair, skin
      const float light = 0.75F + 0.25F * static_cast<float>(x) / 320 + 0.1F * static_cast<float>(y) / 240;
      const float a = truth_alpha(x + 0.5, y + 0.5);
      s.alpha(y, x) = a;
      s.premultiplied(y, x) = a * colour;
      s.picture(y, x) = a * colour + (1 - a) * light * kGreen;
      for (int c = 0; c < 3; ++c) s.picture(y, x)[c] = std::max(0.0F, s.picture(y, x)[c] + noise * uniform());
    }
  return s;
}

double rms(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b) / std::sqrt(static_cast<double>(a.total() * static_cast<std::size_t>(a.channels())));
}
double psnr_db(const cv::Mat& a, const cv::Mat& b) { return -20 * std::log10(rms(a, b)); }

TEST(ChromaKey, RecoversASoftForegroundBeforeAnUnevenScreen) {
  const Shot truth = shot();
  const KeyedPicture keyed = chroma_key(truth.picture, kGreen);
  EXPECT_GE(psnr_db(keyed.bgr, truth.premultiplied), 40);
  EXPECT_LE(rms(keyed.alpha, truth.alpha), 0.03);
  EXPECT_EQ(keyed.alpha(5, 5), 0);
  EXPECT_EQ(keyed.alpha(140, 160), 1);
}

TEST(ChromaKey, KeepsHairSoft) {
  const Shot truth = shot();
  const KeyedPicture keyed = chroma_key(truth.picture, kGreen);
  double error = 0;
  int num = 0;
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x)
      if (truth.alpha(y, x) > 0.1F && truth.alpha(y, x) < 0.9F) {
        error += std::abs(keyed.alpha(y, x) - truth.alpha(y, x));
        ++num;
      }
  ASSERT_GT(num, 500);
  EXPECT_LE(error / num, 0.08);
}

TEST(ChromaKey, NoiseStaysInTheScreenAndOutOfTheForeground) {
  const Shot truth = shot(0.02F);
  const KeyedPicture keyed = chroma_key(truth.picture, kGreen);
  EXPECT_GE(psnr_db(keyed.bgr, truth.premultiplied), 36);
  int speckles = 0, screen = 0;
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x)
      if (std::hypot(x - 160, y - 120) > 100) {
        ++screen;
        speckles += keyed.alpha(y, x) > 0;
      }
  EXPECT_LE(speckles, 0.002 * screen);
}

TEST(ChromaKey, TakesTheScreensLightOffTheForeground) {
  Shot truth = shot();
  for (int y = 100; y < 140; ++y)
    for (int x = 140; x < 180; ++x) truth.picture(y, x) += 0.06F * kGreen;  // reflected
  for (const cv::Vec3f& colour : cv::Mat3f(chroma_key(truth.picture, kGreen).bgr))
    EXPECT_LE(colour[1], std::max(colour[0], colour[2]) + 1e-6F);
}

TEST(ChromaKey, ForegroundOverAnotherBackgroundIsThatComposite) {
  const Shot truth = shot();
  const KeyedPicture keyed = chroma_key(truth.picture, kGreen);
  const cv::Vec3f red(0.05F, 0.05F, 0.6F);
  cv::Mat3f made(keyed.bgr.size()), wanted(keyed.bgr.size());
  for (int y = 0; y < made.rows; ++y)
    for (int x = 0; x < made.cols; ++x) {
      made(y, x) = keyed.bgr(y, x) + (1 - keyed.alpha(y, x)) * red;
      wanted(y, x) = truth.premultiplied(y, x) + (1 - truth.alpha(y, x)) * red;
    }
  EXPECT_GE(psnr_db(made, wanted), 36);
}

TEST(ChromaKey, WithoutAScreenAllIsForeground) {
  const KeyedPicture keyed = chroma_key(cv::Mat3f(48, 64, cv::Vec3f(0.4F, 0.2F, 0.3F)), kGreen);
  EXPECT_EQ(cv::countNonZero(keyed.alpha == 1), 48 * 64);
}

}  // namespace
}  // namespace vantage
