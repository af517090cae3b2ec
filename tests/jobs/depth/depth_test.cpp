#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "jobs/depth/fill_gaps.h"
#include "jobs/depth/fuse_depth.h"
#include "jobs/depth/outlines.h"
#include "jobs/depth/regularise.h"
#include "jobs/depth/triangulate_edge.h"
#include "tests/support/synthetic_scene.h"

namespace vantage {
namespace {

constexpr double kAgreement = 0.015;

using synthetic::kFirstMovingId;
using synthetic::Picture;
using synthetic::Scene;
using synthetic::SceneCamera;
using synthetic::Truth;

FlowMap exact_flow(const Truth& truth) {
  FlowMap flow{truth.motion_px.clone(), cv::Mat1f(truth.visible.size(), 0.0F)};
  flow.confidence.setTo(1.0F, truth.visible);
  return flow;
}

/// The middle of three cameras, its neighbours exposed a bit later and earlier.
class DepthTest : public testing::Test {
 protected:
  DepthTest()
      : cameras_(synthetic::arc_cameras(3, 1, 240, 135)),
        image_(scene_.render(at(1).pinhole, at(1).cam_from_world, kTime_s)) {}

  const SceneCamera& at(std::size_t k) const { return cameras_[k]; }
  Picture expose(std::size_t k, double time_s) const {
    return scene_.render(at(k).pinhole, at(k).cam_from_world, time_s);
  }

  /// What edge 1–k tells when camera k exposed at time_s, with exact correspondences.
  EdgeDepth edge_to(std::size_t k, double time_s, bool corrected) const {
    const FlowMap flow = exact_flow(scene_.correspondence(image_, at(1).pinhole, at(1).cam_from_world, kTime_s,
                                                          at(k).pinhole, at(k).cam_from_world, time_s));
    std::optional<StepFlow> step;
    if (corrected) step = {step_of(k, time_s), kStep_s};
    return triangulate_edge(TwoView(at(1).pinhole, at(1).cam_from_world, at(k).pinhole, at(k).cam_from_world),
                            at(k).pinhole.fx, flow, kTime_s - time_s, step, {});
  }
  FlowMap step_of(std::size_t k, double time_s) const {
    const SceneCamera& c = at(k);
    return exact_flow(scene_.correspondence(expose(k, time_s), c.pinhole, c.cam_from_world, time_s, c.pinhole,
                                            c.cam_from_world, time_s + kStep_s));
  }

  std::vector<double> relative_errors(const cv::Mat1f& z, bool moving) const {
    std::vector<double> errors;
    for (int y = 0; y < z.rows; ++y)
      for (int x = 0; x < z.cols; ++x)
        if (z(y, x) > 0 && image_.depth(y, x) > 0 && (image_.id(y, x) >= kFirstMovingId) == moving)
          errors.push_back(std::abs(z(y, x) / image_.depth(y, x) - 1));
    return errors;
  }
  static double median(std::vector<double> values) {
    if (values.empty()) return 1e9;
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
  }

  static constexpr double kTime_s = 0.3, kLag_s = 0.02, kStep_s = 1.0 / 30;
  Scene scene_;
  std::vector<SceneCamera> cameras_;
  Picture image_;
};

TEST_F(DepthTest, ExactMatchesOfStillThingsGiveExactDepth) {
  const DepthMap depth = fuse_depths(std::vector{edge_to(0, kTime_s, false), edge_to(2, kTime_s, false)}, kAgreement);
  const auto errors = relative_errors(depth.z, false);
  EXPECT_GT(errors.size(), image_.depth.total() * 7 / 10);
  EXPECT_LT(median(errors), 1e-4);
}

TEST_F(DepthTest, RegularisingKeepsItWithinAFifthOfAPercent) {
  const DepthMap depth = regularise(
      fuse_depths(std::vector{edge_to(0, kTime_s, false), edge_to(2, kTime_s, false)}, kAgreement), image_.bgr, {});
  EXPECT_LT(median(relative_errors(depth.z, false)), 0.002);
}

TEST_F(DepthTest, TimeCorrectionMendsThingsThatMoved) {
  const std::vector plain{edge_to(0, kTime_s - kLag_s, false), edge_to(2, kTime_s + kLag_s, false)};
  const std::vector corrected{edge_to(0, kTime_s - kLag_s, true), edge_to(2, kTime_s + kLag_s, true)};
  const auto without = relative_errors(fuse_depths(plain, kAgreement).z, true),
             with = relative_errors(fuse_depths(corrected, kAgreement).z, true);
  ASSERT_GT(with.size(), 50U);
  EXPECT_LT(median(with), 0.005);
  EXPECT_TRUE(without.size() < with.size() / 2 || median(without) > 3 * median(with))
      << median(without) << " " << median(with);
}

TEST_F(DepthTest, TimeCorrectionLeavesStillThingsAlone) {
  EXPECT_LT(median(relative_errors(fuse_depths(std::vector{edge_to(2, kTime_s + kLag_s, true)}, kAgreement).z, false)),
            1e-4);
}

TEST_F(DepthTest, NothingIsKnownWithoutMatches) {
  EdgeDepth nothing = edge_to(0, kTime_s, false);
  nothing.weight.setTo(0);
  const DepthMap depth = regularise(fuse_depths(std::vector{nothing}, kAgreement), image_.bgr, {});
  EXPECT_EQ(cv::countNonZero(depth.z), 0);
  EXPECT_EQ(cv::countNonZero(depth.confidence), 0);
}

TEST_F(DepthTest, MatchesOffTheEpipolarLineAreNotUsed) {
  const TwoView views(at(1).pinhole, at(1).cam_from_world, at(2).pinhole, at(2).cam_from_world);
  FlowMap flow = exact_flow(scene_.correspondence(image_, at(1).pinhole, at(1).cam_from_world, kTime_s, at(2).pinhole,
                                                  at(2).cam_from_world, kTime_s));
  flow.motion_px += cv::Scalar(0, 4);
  const EdgeDepth depth = triangulate_edge(views, at(2).pinhole.fx, flow, 0, std::nullopt, {});
  EXPECT_LT(cv::countNonZero(depth.weight), static_cast<int>(depth.weight.total() / 100));
}

TEST_F(DepthTest, RaysThatHardlyMeetTellNothing) {
  SceneCamera near = at(1);
  near.cam_from_world.t.x() -= 0.02;  // 0.3 degrees at 4 m
  const FlowMap flow = exact_flow(scene_.correspondence(image_, at(1).pinhole, at(1).cam_from_world, kTime_s,
                                                        near.pinhole, near.cam_from_world, kTime_s));
  const EdgeDepth depth = triangulate_edge({at(1).pinhole, at(1).cam_from_world, near.pinhole, near.cam_from_world},
                                           near.pinhole.fx, flow, 0, std::nullopt, {});
  EXPECT_EQ(cv::countNonZero(depth.weight), 0);
}

TEST(FuseDepths, TwoThatAgreeOutvoteOneThatDoesNot) {
  const auto edge = [](float z) { return EdgeDepth{cv::Mat1f(1, 1, 1 / z), cv::Mat1f(1, 1, 10.0F)}; };
  const DepthMap depth = fuse_depths(std::vector{edge(4.0F), edge(9.0F), edge(4.01F)}, kAgreement);
  EXPECT_NEAR(depth.z(0, 0), 4.005, 0.002);
  EXPECT_GT(depth.confidence(0, 0), kLoneConfidence);
}

TEST(FuseDepths, ALoneVoteIsNotTrustedMuch) {
  const DepthMap depth = fuse_depths(std::vector{EdgeDepth{cv::Mat1f(1, 1, 0.5F), cv::Mat1f(1, 1, 10.0F)}}, kAgreement);
  EXPECT_FLOAT_EQ(depth.z(0, 0), 2);
  EXPECT_LE(depth.confidence(0, 0), kLoneConfidence);
}

/// A near disc before a far wall, each of its own colour; the depth's outline is `grown_px` wider than the picture's.
struct DiscScene {
  explicit DiscScene(int grown_px) : inverse_depth(120, 160, 0.1F), confidence(120, 160, 1.0F), guide(120, 160) {
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 160; ++x) {
        const double r = std::hypot(x - 80, y - 60);
        const auto grain = static_cast<uchar>((7 * x + 13 * y) % 9);
        if (r <= 30 + grown_px) inverse_depth(y, x) = 0.2F;
        guide(y, x) = r <= 30 ? cv::Vec3b(200, 90 + grain, 60) : cv::Vec3b(70, 120, 150 + grain);
      }
  }
  /// Pixels whose depth is not that of what the picture shows there.
  int num_wrong() const {
    int wrong = 0;
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 160; ++x)
        wrong += std::abs(inverse_depth(y, x) - (std::hypot(x - 80, y - 60) <= 30 ? 0.2F : 0.1F)) > 0.01F;
    return wrong;
  }
  cv::Mat1f inverse_depth, confidence;
  cv::Mat3b guide;
};

TEST(Outlines, StepsOfDepthMoveToThoseOfThePicture) {
  for (const int grown_px : {-1, 1}) {
    DiscScene scene(grown_px);
    const int before = scene.num_wrong();
    align_outlines(scene.inverse_depth, scene.confidence, scene.guide);
    EXPECT_LT(scene.num_wrong(), before / 10) << grown_px;
  }
}

TEST(Outlines, WithoutContrastDepthStaysAsItIs) {
  DiscScene scene(1);
  scene.guide.setTo(cv::Scalar::all(90));
  const cv::Mat1f before = scene.inverse_depth.clone();
  align_outlines(scene.inverse_depth, scene.confidence, scene.guide);
  EXPECT_EQ(cv::norm(before, scene.inverse_depth, cv::NORM_INF), 0);
}

TEST(SmoothSurfaces, TakesOutNoiseAndKeepsSteps) {
  DiscScene scene(0);
  cv::Mat1f noisy = scene.inverse_depth.clone();
  for (int y = 0; y < noisy.rows; ++y)
    for (int x = 0; x < noisy.cols; ++x) noisy(y, x) *= 1 + 0.002F * static_cast<float>((31 * x + 17 * y) % 7 - 3) / 3;
  const cv::Mat1f smooth = smooth_surfaces(noisy, scene.confidence, scene.guide, 0.01);
  EXPECT_LT(cv::norm(smooth, scene.inverse_depth, cv::NORM_L2),
            0.4 * cv::norm(noisy, scene.inverse_depth, cv::NORM_L2));
  EXPECT_LT(cv::norm(smooth, scene.inverse_depth, cv::NORM_INF), 0.001);
}

TEST(FillGaps, WhatIsHiddenBesideSomethingNearIsFar) {
  DiscScene scene(0);
  const cv::Rect hidden(108, 58, 6, 5);  // beside the disc's right side, on the wall, and a bit of the disc
  scene.inverse_depth(hidden).setTo(0);
  scene.confidence(hidden).setTo(0);
  fill_gaps(scene.inverse_depth, scene.confidence, 1);
  EXPECT_NEAR(scene.inverse_depth(60, 111), 0.1F, 1e-4);
  EXPECT_FLOAT_EQ(scene.confidence(60, 111), kFilledConfidence);
}

TEST(FillGaps, SlantedGroundGoesOnAcrossAGap) {
  cv::Mat1f ground(60, 80), confidence(60, 80, 1.0F);
  for (int y = 0; y < 60; ++y) ground.row(y).setTo(0.2F + 0.001F * static_cast<float>(y));
  const float truth = ground(30, 40);
  ground(cv::Rect(35, 26, 10, 9)).setTo(0);
  fill_gaps(ground, confidence, 5);
  EXPECT_NEAR(ground(30, 40), truth, 0.001);
}

TEST(FillGaps, LargeUnknownAreasStayUnknown) {
  cv::Mat1f inverse_depth(60, 80, 0.3F), confidence(60, 80, 1.0F);
  for (const cv::Rect& gap : {cv::Rect(10, 10, 4, 4), cv::Rect(40, 20, 20, 20)}) {
    inverse_depth(gap).setTo(0);
    confidence(gap).setTo(0);
  }
  fill_gaps(inverse_depth, confidence, 1);
  EXPECT_NEAR(inverse_depth(12, 12), 0.3, 1e-4);
  EXPECT_EQ(inverse_depth(30, 50), 0);
  EXPECT_EQ(confidence(30, 50), 0);
}

}  // namespace
}  // namespace vantage
