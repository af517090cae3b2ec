#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "jobs/depth/fuse_depth.h"
#include "jobs/depth/triangulate_edge.h"
#include "tests/support/synthetic_scene.h"

namespace vantage {
namespace {

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
  const DepthMap depth = fuse_depths(std::vector{edge_to(0, kTime_s, false), edge_to(2, kTime_s, false)}, {});
  const auto errors = relative_errors(depth.z, false);
  EXPECT_GT(errors.size(), image_.depth.total() * 7 / 10);
  EXPECT_LT(median(errors), 1e-4);
}

TEST_F(DepthTest, RegularisingKeepsItWithinAFifthOfAPercent) {
  const FuseDepthOptions options;
  const DepthMap depth = regularise(
      fuse_depths(std::vector{edge_to(0, kTime_s, false), edge_to(2, kTime_s, false)}, options), image_.bgr, options);
  EXPECT_LT(median(relative_errors(depth.z, false)), 0.002);
}

TEST_F(DepthTest, TimeCorrectionMendsThingsThatMoved) {
  const std::vector plain{edge_to(0, kTime_s - kLag_s, false), edge_to(2, kTime_s + kLag_s, false)};
  const std::vector corrected{edge_to(0, kTime_s - kLag_s, true), edge_to(2, kTime_s + kLag_s, true)};
  const auto without = relative_errors(fuse_depths(plain, {}).z, true),
             with = relative_errors(fuse_depths(corrected, {}).z, true);
  ASSERT_GT(with.size(), 50U);
  EXPECT_LT(median(with), 0.005);
  EXPECT_TRUE(without.size() < with.size() / 2 || median(without) > 3 * median(with))
      << median(without) << " " << median(with);
}

TEST_F(DepthTest, TimeCorrectionLeavesStillThingsAlone) {
  EXPECT_LT(median(relative_errors(fuse_depths(std::vector{edge_to(2, kTime_s + kLag_s, true)}, {}).z, false)), 1e-4);
}

TEST_F(DepthTest, NothingIsKnownWithoutMatches) {
  EdgeDepth nothing = edge_to(0, kTime_s, false);
  nothing.strength.setTo(0);
  const FuseDepthOptions options;
  const DepthMap depth = regularise(fuse_depths(std::vector{nothing}, options), image_.bgr, options);
  EXPECT_EQ(cv::countNonZero(depth.z), 0);
  EXPECT_EQ(cv::countNonZero(depth.confidence), 0);
}

TEST_F(DepthTest, MatchesOffTheEpipolarLineAreNotUsed) {
  const TwoView views(at(1).pinhole, at(1).cam_from_world, at(2).pinhole, at(2).cam_from_world);
  FlowMap flow = exact_flow(scene_.correspondence(image_, at(1).pinhole, at(1).cam_from_world, kTime_s, at(2).pinhole,
                                                  at(2).cam_from_world, kTime_s));
  flow.motion_px += cv::Scalar(0, 4);
  const EdgeDepth depth = triangulate_edge(views, at(2).pinhole.fx, flow, 0, std::nullopt, {});
  EXPECT_LT(cv::countNonZero(depth.strength), static_cast<int>(depth.strength.total() / 100));
}

TEST_F(DepthTest, RaysThatHardlyMeetTellNothing) {
  SceneCamera near = at(1);
  near.cam_from_world.t.x() -= 0.02;  // 0.3 degrees at 4 m
  const FlowMap flow = exact_flow(scene_.correspondence(image_, at(1).pinhole, at(1).cam_from_world, kTime_s,
                                                        near.pinhole, near.cam_from_world, kTime_s));
  const EdgeDepth depth = triangulate_edge({at(1).pinhole, at(1).cam_from_world, near.pinhole, near.cam_from_world},
                                           near.pinhole.fx, flow, 0, std::nullopt, {});
  EXPECT_EQ(cv::countNonZero(depth.strength), 0);
}

TEST(FuseDepths, TwoThatAgreeOutvoteOneThatDoesNot) {
  const auto edge = [](float z) { return EdgeDepth{cv::Mat1f(1, 1, 1 / z), cv::Mat1f(1, 1, 10.0F)}; };
  const DepthMap depth = fuse_depths(std::vector{edge(4.0F), edge(9.0F), edge(4.01F)}, {});
  EXPECT_NEAR(depth.z(0, 0), 4.005, 0.002);
  EXPECT_GT(depth.confidence(0, 0), kLoneConfidence);
}

TEST(FuseDepths, ALoneVoteIsNotTrustedMuch) {
  const DepthMap depth = fuse_depths(std::vector{EdgeDepth{cv::Mat1f(1, 1, 0.5F), cv::Mat1f(1, 1, 10.0F)}}, {});
  EXPECT_FLOAT_EQ(depth.z(0, 0), 2);
  EXPECT_LE(depth.confidence(0, 0), kLoneConfidence);
}

TEST(Regularise, FillsSmallSpotsAndLeavesLargeOnesUnknown) {
  DepthMap depth{cv::Mat1f(60, 80, 3.0F), cv::Mat1f(60, 80, 1.0F)};
  depth.z(cv::Rect(10, 10, 4, 4)).setTo(0);
  depth.confidence(cv::Rect(10, 10, 4, 4)).setTo(0);
  depth.z(cv::Rect(40, 20, 20, 20)).setTo(0);
  depth.confidence(cv::Rect(40, 20, 20, 20)).setTo(0);
  const DepthMap out = regularise(depth, cv::Mat(60, 80, CV_8UC3, cv::Scalar::all(90)), {});
  EXPECT_NEAR(out.z(12, 12), 3, 1e-3);
  EXPECT_EQ(out.z(30, 50), 0);
  EXPECT_EQ(out.confidence(30, 50), 0);
}

}  // namespace
}  // namespace vantage
