#include "jobs/render/composite.h"

#include <gtest/gtest.h>

#include <cmath>

#include "jobs/render/render_view.h"
#include "jobs/render/write_frame.h"
#include "jobs/vision/chroma_key.h"
#include "schema/base/error.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

ViewPicture picture_of(cv::Size size, const cv::Vec3f& bgr, float alpha, float z) {
  return {cv::Mat3f(size, bgr), cv::Mat1f(size, alpha), cv::Mat1f(size, z), cv::Mat1f(size, 0.0F),
          cv::Mat3b(size, cv::Vec3b(0, 0, 0))};
}

TEST(PutOver, MixesPremultipliedColours) {
  const ViewPicture out =
      put_over(picture_of({4, 4}, {0.1F, 0.2F, 0.3F}, 0.25F, 2), picture_of({4, 4}, {0.4F, 0.4F, 0.8F}, 1, 3));
  EXPECT_NEAR(out.bgr(1, 1)[0], 0.1 + 0.75 * 0.4, 1e-6);
  EXPECT_NEAR(out.bgr(1, 1)[2], 0.3 + 0.75 * 0.8, 1e-6);
  EXPECT_EQ(out.alpha(1, 1), 1);
  EXPECT_EQ(out.z(1, 1), 3);  // most of what is seen is behind
}

TEST(PutOver, WhatIsNearerInTheSetHidesTheForeground) {
  ViewPicture set = picture_of({4, 4}, {0.4F, 0.4F, 0.4F}, 1, 3);
  set.z(0, 0) = 1;
  set.z(0, 1) = 0;
  const ViewPicture out = put_over(picture_of({4, 4}, {0.1F, 0.2F, 0.3F}, 1, 2), set);
  EXPECT_EQ(out.bgr(0, 0), set.bgr(0, 0));
  EXPECT_EQ(out.z(0, 0), 1);
  EXPECT_NEAR(out.bgr(0, 1)[2], 0.3, 1e-6);  // unknown depth is behind
  EXPECT_NEAR(out.bgr(2, 2)[2], 0.3, 1e-6);
  EXPECT_EQ(out.z(2, 2), 2);
}

TEST(ReadRendered, GivesBackWhatRenderWrote) {
  const TemporaryFolder folder;
  const ViewPicture left = picture_of({8, 6}, {0.25F, 0.5F, 0.75F}, 0.5F, 2.5F),
                    right = picture_of({8, 6}, {0.125F, 0, 1}, 1, 7);
  write_frame_exr(folder.path() / "frame.exr", {{"left", left}, {"right", right}});
  const ViewPicture again = read_rendered(folder.path() / "frame.exr", "right", {8, 6});
  EXPECT_EQ(cv::norm(again.bgr, right.bgr, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(again.z, right.z, cv::NORM_INF), 0);
  EXPECT_EQ(read_rendered(folder.path() / "frame.exr", "left", {8, 6}).alpha(3, 3), 0.5F);
  EXPECT_THROW(read_rendered(folder.path() / "frame.exr", "left", {9, 6}), Error);
}

TEST(FramePng, HoldsStraightColours) {
  const cv::Mat4b png = frame_png({{"", picture_of({4, 4}, {0.5F, 0.25F, 0.125F}, 0.5F, 1)}});
  EXPECT_EQ(png(1, 1)[0], 255);
  EXPECT_EQ(png(1, 1)[1], 188);  // half the light
  EXPECT_NEAR(png(1, 1)[3], 128, 1);
}

constexpr int kWidth = 160, kHeight = 120;
const cv::Vec3f kGreen(0.08F, 0.5F, 0.06F);

/// Seen by a camera at x, that looks along z: a wall at 4 with a screen of the key's colour, and before it at 2 a panel
/// with a soft pattern, half its rim a pixel wide.
SourceImage filmed(double camera_x, cv::Mat1f* truth_alpha = nullptr) {
  SourceImage image;
  image.id = {"cam", static_cast<int>(100 * camera_x)};
  image.pinhole = {kWidth, kHeight, 100, 100, kWidth / 2.0, kHeight / 2.0};
  image.cam_from_world.t.x() = -camera_x;
  image.bgr.create(kHeight, kWidth);
  image.depth = {cv::Mat1f(kHeight, kWidth), cv::Mat1f(kHeight, kWidth, 1.0F)};
  if (truth_alpha != nullptr) truth_alpha->create(kHeight, kWidth);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const Eigen::Vector3d p = 2 * image.pinhole.ray({x + 0.5, y + 0.5});
      const double px = p.x() + camera_x, inside_px = (0.5 - std::max(std::abs(px), std::abs(p.y()))) * 100 / 2;
      const auto a = static_cast<float>(std::clamp(inside_px + 0.5, 0.0, 1.0));
      const auto wave = static_cast<float>(0.1 * std::sin(12 * px) * std::cos(12 * p.y()));
      image.bgr(y, x) = a * cv::Vec3f(0.3F + wave, 0.25F + wave, 0.5F + wave) + (1 - a) * kGreen;
      image.depth.z(y, x) = a > 0.5F ? 2.0F : 4.0F;
      if (truth_alpha != nullptr) (*truth_alpha)(y, x) = a;
    }
  return image;
}

TEST(Render, CarriesMattesIntoTheView) {
  std::vector<SourceImage> images{filmed(-0.1), filmed(0.1)};
  for (SourceImage& image : images) {
    const KeyedPicture keyed = chroma_key(image.bgr, kGreen);
    image.bgr = keyed.bgr;
    image.alpha = keyed.alpha;
  }
  FramePlan plan;
  plan.method = "depth";
  plan.scene_distance = 2;
  for (const SourceImage& image : images) plan.images.push_back({image.id, 0});
  PlannedEye eye;
  eye.pinhole = images[0].pinhole;
  eye.mu = eye.share = {0.5, 0.5};
  const ViewPicture view = render_eye(images, plan, eye);
  cv::Mat1f truth;
  filmed(0, &truth);
  int wrong = 0, green = 0;
  for (int y = 4; y < kHeight - 4; ++y)
    for (int x = 12; x < kWidth - 12; ++x) {
      wrong += std::abs(view.alpha(y, x) - truth(y, x)) > 0.25F;
      const cv::Vec3f& c = view.bgr(y, x);
      green += c[1] > std::max(c[0], c[2]) + 0.02F;
      for (int k = 0; k < 3; ++k) EXPECT_LE(c[k], view.alpha(y, x) + 0.05F);  // premultiplied
    }
  EXPECT_EQ(green, 0);
  EXPECT_LE(wrong, 100);  // of 200 pixels of rim
  EXPECT_EQ(view.alpha(kHeight / 2, kWidth / 2), 1);
  EXPECT_EQ(view.alpha(10, kWidth / 2), 0);
}

}  // namespace
}  // namespace vantage
