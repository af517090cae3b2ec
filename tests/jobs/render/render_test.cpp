#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "jobs/render/behind_edges.h"
#include "jobs/render/push_pull.h"
#include "jobs/render/render_view.h"
#include "jobs/render/write_frame.h"
#include "jobs/vision/colour_space.h"
#include "tests/support/synthetic_scene.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

using synthetic::Picture;
using synthetic::Scene;
using synthetic::SceneCamera;

constexpr int kWidth = 240, kHeight = 135;

double psnr_db(const cv::Mat3b& a, const cv::Mat3b& b) {
  double sum = 0;
  for (int y = 0; y < a.rows; ++y)
    for (int x = 0; x < a.cols; ++x)
      for (int c = 0; c < 3; ++c) sum += std::pow(double(a(y, x)[c]) - b(y, x)[c], 2);
  return 10 * std::log10(255.0 * 255.0 / std::max(sum / (3.0 * a.rows * a.cols), 1e-6));
}

cv::Mat3b eight_bit(const ViewPicture& picture) { return srgb8_from_linear(picture.bgr); }

/// Two frames of each of two neighbouring cameras, with exact maps and depth.
struct Bench {
  Scene scene;
  std::vector<SceneCamera> cameras = synthetic::arc_cameras(2, 2, kWidth, kHeight, 8, 0);
  std::vector<SourceImage> images;
  FramePlan plan;
};

FlowMap flow_map(const synthetic::Truth& truth) {
  FlowMap flow{truth.motion_px.clone(), cv::Mat1f(truth.motion_px.size(), 0.0F)};
  for (int y = 0; y < flow.confidence.rows; ++y)
    for (int x = 0; x < flow.confidence.cols; ++x)
      if (truth.visible(y, x))
        flow.confidence(y, x) = 1;
      else
        flow.motion_px(y, x) = {0, 0};
  return flow;
}

Bench bench(bool moving) {
  Bench b{.scene = Scene({.moving = moving}), .images = {}, .plan = {}};
  std::vector<Picture> pictures;
  for (const SceneCamera& camera : b.cameras)
    for (int k = 0; k < camera.num_frames; ++k) {
      pictures.push_back(b.scene.render(camera.pinhole, camera.cam_from_world, camera.time_s(k)));
      const Picture& p = pictures.back();
      cv::Mat1f confidence(p.depth.size(), 1.0F);
      b.images.push_back({{camera.name, k},
                          camera.time_s(k),
                          camera.pinhole,
                          camera.cam_from_world,
                          linear_from_srgb(p.bgr),
                          {p.depth, confidence},
                          {}});
      b.plan.images.push_back({{camera.name, k}, camera.time_s(k)});
    }
  for (std::size_t i = 0; i < b.images.size(); ++i)
    for (std::size_t k = 0; k < b.images.size(); ++k) {
      if (i == k) continue;
      const SourceImage &from = b.images[i], &to = b.images[k];
      b.images[i].flows[static_cast<int>(k)] = flow_map(b.scene.correspondence(
          pictures[i], from.pinhole, from.cam_from_world, from.time_s, to.pinhole, to.cam_from_world, to.time_s));
    }
  return b;
}

/// The eye with centre and time Σ mu_k of the images', oriented like the first.
PlannedEye eye_between(Bench& b, const std::vector<double>& mu) {
  PlannedEye eye;
  eye.pinhole = b.images[0].pinhole;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  b.plan.time_s = 0;
  for (std::size_t k = 0; k < mu.size(); ++k) {
    centre += mu[k] * b.images[k].cam_from_world.centre();
    b.plan.time_s += mu[k] * b.images[k].time_s;
  }
  eye.cam_from_world.R = b.images[0].cam_from_world.R;
  eye.cam_from_world.t = -eye.cam_from_world.R * centre;
  eye.mu = mu;
  eye.share = mu;
  for (double& s : eye.share) s = (s + 1e-3) / (1 + 1e-3 * static_cast<double>(mu.size()));
  return eye;
}

struct Scores {
  double drawn_db = 0, nearest_db = 0, holes = 0;
};

Scores score(Bench& b, const std::string& method, const std::vector<double>& mu) {
  b.plan.method = method;
  const PlannedEye eye = eye_between(b, mu);
  b.plan.scene_distance = (eye.cam_from_world * b.scene.centre()).norm();
  const ViewPicture picture = render_eye(b.images, b.plan, eye);
  const cv::Mat3b truth = b.scene.render(eye.pinhole, eye.cam_from_world, b.plan.time_s).bgr;
  Scores scores;
  scores.drawn_db = psnr_db(eight_bit(picture), truth);
  for (const SourceImage& image : b.images)
    scores.nearest_db = std::max(scores.nearest_db, psnr_db(srgb8_from_linear(image.bgr), truth));
  scores.holes = 1 - cv::mean(picture.alpha)[0];
  return scores;
}

const std::vector<double> kBetween{0.3, 0.25, 0.25, 0.2};

TEST(Render, AtAnImageTheViewIsThatImage) {
  Bench b = bench(true);
  for (const char* method : {"correspondence", "depth", "auto"})
    EXPECT_GE(score(b, method, {1, 0, 0, 0}).drawn_db, 45) << method;
}

TEST(Render, InBetweenByCorrespondencesBeatsTheNearestImage) {
  Bench b = bench(true);
  const Scores s = score(b, "correspondence", kBetween);
  EXPECT_GE(s.drawn_db, s.nearest_db + 5);
  EXPECT_GE(s.drawn_db, 32);
  EXPECT_LT(s.holes, 0.06) << "what neither camera shows";
}

TEST(Render, InBetweenByDepthBeatsTheNearestImage) {
  Bench b = bench(true);
  for (const char* method : {"depth", "auto"}) {
    const Scores s = score(b, method, kBetween);
    EXPECT_GE(s.drawn_db, s.nearest_db + 5) << method;
    EXPECT_GE(s.drawn_db, 32) << method;
  }
}

TEST(Render, Equation6AsPrintedDrawsTwoThreeAndFourImages) {
  Bench b = bench(true);
  for (const std::vector<double>& mu :
       {kBetween, std::vector<double>{0.5, 0, 0.5, 0}, std::vector<double>{0.4, 0.3, 0.3, 0}}) {
    const Scores s = score(b, "plain", mu);
    EXPECT_GE(s.drawn_db, s.nearest_db + 3);
  }
  EXPECT_GE(score(b, "plain", {1, 0, 0, 0}).drawn_db, 50);
}

/// Where the pixels of a moving scene go until the next frame, whose camera stands elsewhere, too.
TEST(Render, ForwardMotionLeadsToTheNextFrame) {
  Bench b = bench(true);
  b.plan.method = "depth";
  PlannedEye eye = eye_between(b, kBetween);
  RigidTransform next = eye.cam_from_world;
  next.t.x() += 0.1;
  const double next_s = b.plan.time_s + 0.01;
  eye.next = NextEye{eye.pinhole, next, next_s};
  const ViewPicture picture = render_eye(b.images, b.plan, eye);
  const Picture now = b.scene.render(eye.pinhole, eye.cam_from_world, b.plan.time_s);
  const cv::Mat2f truth =
      b.scene.correspondence(now, eye.pinhole, eye.cam_from_world, b.plan.time_s, eye.pinhole, next, next_s).motion_px;
  int close = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) close += cv::norm(picture.forward(y, x) - truth(y, x)) < 0.25;
  EXPECT_GT(cv::norm(truth(kHeight / 2, kWidth / 2)), 1);
  EXPECT_GE(close, 0.9 * kWidth * kHeight);
}

TEST(Render, TwoAndThreeImagesAreEnough) {
  Bench b = bench(true);
  for (const std::vector<double>& mu : {std::vector<double>{0.5, 0, 0.5, 0}, std::vector<double>{0.4, 0.3, 0.3, 0}}) {
    const Scores s = score(b, "correspondence", mu);
    EXPECT_GE(s.drawn_db, s.nearest_db + 5);
  }
}

TEST(Render, ViewsOffTheCameraSurfaceAreDrawnByDepth) {
  Bench b = bench(false);
  b.plan.method = "depth";
  PlannedEye eye = eye_between(b, kBetween);
  eye.cam_from_world.t += Eigen::Vector3d(0, 0.15, -0.3);
  const ViewPicture picture = render_eye(b.images, b.plan, eye);
  const Picture truth = b.scene.render(eye.pinhole, eye.cam_from_world, b.plan.time_s);
  EXPECT_GE(psnr_db(eight_bit(picture), truth.bgr), 25);
  int close = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) close += std::abs(picture.z(y, x) / truth.depth(y, x) - 1) < 0.01;
  EXPECT_GE(close, 0.94 * kWidth * kHeight);
}

TEST(Render, CorrespondencesAloneGiveTheDepthOfAStaticScene) {
  Bench b = bench(false);
  const DepthMap depth = triangulated_depth(b.images, 0);
  int known = 0, close = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      if (depth.z(y, x) <= 0) continue;
      ++known;
      close += std::abs(depth.z(y, x) / b.images[0].depth.z(y, x) - 1) < 0.01;
    }
  EXPECT_GT(known, 0.6 * kWidth * kHeight);
  EXPECT_GT(close, 0.99 * known);
}

TEST(Render, DepthStereoPutsNearThingsRightInTheLeftEye) {
  Bench b = bench(false);
  b.plan.method = "depth";
  PlannedEye left = eye_between(b, {1, 0, 0, 0}), right = left;
  const double z = b.images[0].depth.z(kHeight / 2, kWidth / 2);
  const StereoRig rig{0.1, left.pinhole.fx * 0.1, 0};
  const DisparityRule to_the_right{1, rig, {}}, to_the_left{-1, rig, {}};
  EXPECT_NEAR(to_the_right.shift_px(z) - to_the_left.shift_px(z), left.pinhole.fx * 0.1 / z, 1e-9);
  left.disparity = to_the_right;
  right.disparity = to_the_left;
  // The left picture is what a camera half the distance to the left would see.
  RigidTransform displaced = left.cam_from_world;
  displaced.t.x() += 0.05;
  const cv::Mat3b truth = b.scene.render(left.pinhole, displaced, b.plan.time_s).bgr;
  const double own = psnr_db(eight_bit(render_eye(b.images, b.plan, left)), truth);
  const double other = psnr_db(eight_bit(render_eye(b.images, b.plan, right)), truth);
  EXPECT_GE(own, 25);
  EXPECT_GE(own, other + 5);
}

TEST(BehindEdges, OnlyTheFarSideOfASilhouetteIsWorthLess) {
  cv::Mat1f z(9, 20, 2.0F);
  z.colRange(10, 20).setTo(5);
  const cv::Mat1f worth = worth_behind_edges(z);
  EXPECT_EQ(worth(4, 9), 1) << "the near surface";
  EXPECT_LT(worth(4, 10), worth(4, 11));
  EXPECT_LT(worth(4, 11), 1);
  EXPECT_EQ(worth(4, 12), 1);
}

TEST(Render, IsTheSameEachTimeAndForAnyNumberOfThreads) {
  Bench b = bench(true);
  const PlannedEye eye = eye_between(b, kBetween);
  const ViewPicture one = render_eye(b.images, b.plan, eye), two = render_eye(b.images, b.plan, eye);
  EXPECT_EQ(cv::norm(one.bgr, two.bgr, cv::NORM_INF), 0);
  cv::setNumThreads(1);
  const ViewPicture alone = render_eye(b.images, b.plan, eye);
  cv::setNumThreads(3);
  const ViewPicture many = render_eye(b.images, b.plan, eye);
  cv::setNumThreads(-1);
  EXPECT_EQ(cv::norm(alone.bgr, many.bgr, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(alone.bgr, one.bgr, cv::NORM_INF), 0);
}

TEST(WriteFrame, StereoExrHasBothViewsInLinearLight) {
  const TemporaryFolder folder;
  ViewPicture left;
  left.bgr = cv::Mat3f(4, 6, cv::Vec3f(0.5F, 0.25F, 1));
  left.alpha = cv::Mat1f(4, 6, 1.0F);
  left.z = cv::Mat1f(4, 6, 3.0F);
  left.hole = cv::Mat1f(4, 6, 0.25F);
  left.forward = cv::Mat2f(4, 6, cv::Vec2f(2, 3));
  ViewPicture right = left;
  right.bgr = cv::Mat3f(4, 6, cv::Vec3f(0, 0, 0));
  write_frame_exr(folder.path() / "f.exr", {{"left", left}, {"right", right}});
  const Channels l = read_exr(folder.path() / "f.exr", "left"), r = read_exr(folder.path() / "f.exr", "right");
  EXPECT_NEAR(l.at("B").values[0], 0.5, 2e-4);
  EXPECT_NEAR(l.at("R").values[0], 1, 1e-3);
  EXPECT_EQ(l.at("Z").values[5], 3.0F);
  EXPECT_EQ(r.at("G").values[0], 0.0F);
  EXPECT_EQ(l.at("forward.u").values[0], 2);
  EXPECT_EQ(l.at("forward.v").values[0], -3) << "up";
  EXPECT_EQ(l.at("mask.hole").values[0], 0.25F);
  const cv::Mat png = frame_png({{"left", left}, {"right", right}});
  EXPECT_EQ(png.size(), cv::Size(12, 4));
  EXPECT_EQ(png.at<cv::Vec4b>(0, 0), cv::Vec4b(188, 137, 255, 255));  // sRGB of 1/2, 1/4 and 1
}

TEST(PushPull, KeepsKnownValuesAndFillsTheRest) {
  cv::Mat_<cv::Vec<float, 1>> values(20, 30, cv::Vec<float, 1>(0.0F));
  cv::Mat1f weight(20, 30, 0.0F);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 30; ++x)
      if (x < 5 || x > 25) {
        values(y, x)[0] = x < 5 ? 1 : 3;
        weight(y, x) = 1;
      }
  push_pull<1>(values, weight);
  EXPECT_EQ(values(3, 2)[0], 1);
  EXPECT_NEAR(values(10, 15)[0], 2, 0.6);
  for (const auto& v : values) EXPECT_TRUE(v[0] >= 0.999F && v[0] <= 3.001F);
}

}  // namespace
}  // namespace vantage
