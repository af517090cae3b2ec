#include <gtest/gtest.h>

#include "jobs/render/measure_disparity.h"
#include "jobs/render/scene_disparity.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

constexpr int kWidth = 1000, kHeight = 100;

/// Eyes 0.1 apart that meet at distance 5; focal length 1000: disparity 100 / z - 20 px.
StereoPlan some_plan() {
  StereoPlan plan;
  plan.rig = {0.1, 100, 0.2};
  plan.mapping.width_px = kWidth;
  return plan;
}

/// A wall at distance 10, that is 10 px or 1 % behind the screen.
ViewPicture wall() {
  const cv::Size size(kWidth, kHeight);
  return {cv::Mat3f(size, cv::Vec3f(0.2F, 0.3F, 0.4F)),
          cv::Mat1f(size, 1.0F),
          cv::Mat1f(size, 10.0F),
          cv::Mat1f(size, 0.0F),
          {},
          {},
          {}};
}

TEST(MeasureDisparity, IsInPercentOfTheWidthNegativeInFront) {
  ViewPicture left = wall(), right = wall();
  left.z.rowRange(0, 10).setTo(2.5);  // 20 px in front
  right.z.rowRange(0, 10).setTo(2.5);
  left.z.rowRange(10, 20).setTo(0);
  const FrameDisparity d = measure_disparity(left, right, some_plan(), {});
  EXPECT_NEAR(d.nearest_percent, -2, 1e-6);
  EXPECT_NEAR(d.farthest_percent, 1, 1e-6);
  EXPECT_NEAR(d.p50_percent, 1, 0.05);
  EXPECT_GE(d.p0_1_percent, d.nearest_percent);
  EXPECT_LE(d.p99_9_percent, d.farthest_percent);
  EXPECT_NEAR(d.too_near_share, 2000.0 / 19000, 1e-9);
  EXPECT_EQ(d.too_far_share, 0);
}

TEST(MeasureDisparity, LooksAtWhatTheMapMakesOfIt) {
  const FrameDisparity d = measure_disparity(wall(), wall(), some_plan(), DisparityCurve::line(3, 0));
  EXPECT_NEAR(d.farthest_percent, 3, 1e-6);
  EXPECT_EQ(d.too_far_share, 1);
}

TEST(MeasureDisparity, FindsWhatThePicturesFrameCutsOff) {
  ViewPicture left = wall(), right = wall();
  left.z(cv::Rect(0, 0, 60, 40)).setTo(2.5);     // at the left border, 40 % of its height
  right.z(cv::Rect(500, 0, 60, 40)).setTo(2.5);  // in the middle: cut off by nothing
  StereoPlan plan = some_plan();
  const FrameDisparity d = measure_disparity(left, right, plan, {});
  EXPECT_NEAR(d.cut_left_share, 0.4, 1e-9);
  EXPECT_EQ(d.cut_right_share, 0);
  EXPECT_NEAR(d.cut_percent, 2, 1e-6);
  plan.floating_window_percent = 2;
  EXPECT_EQ(measure_disparity(left, right, plan, {}).cut_left_share, 0);
}

TEST(FloatingWindow, BlacksOutTheLeftEyesLeftAndTheRightEyesRight) {
  ViewPicture left = wall(), right = wall();
  StereoPlan plan = some_plan();
  plan.floating_window_percent = 3;
  draw_floating_window(left, right, plan);
  EXPECT_EQ(cv::countNonZero(left.z == 0), 30 * kHeight);
  EXPECT_EQ(left.bgr(5, 29), cv::Vec3f(0, 0, 0));
  EXPECT_NE(left.bgr(5, 30), cv::Vec3f(0, 0, 0));
  EXPECT_EQ(right.bgr(5, 970), cv::Vec3f(0, 0, 0));
  EXPECT_NE(right.bgr(5, 969), cv::Vec3f(0, 0, 0));
}

TEST(MeasureDisparity, RecordSurvivesItsFile) {
  const TemporaryFolder folder;
  const FrameDisparity d = measure_disparity(wall(), wall(), some_plan(), DisparityCurve::line(1.3, -2));
  write_frame_disparity(folder.path() / "disparity.json", d);
  EXPECT_EQ(to_json(read_frame_disparity(folder.path() / "disparity.json")), to_json(d));
}

TEST(SceneDisparities, CountWhatTheMiddleCameraSees) {
  DisparityKnot knot;
  knot.pinhole = {kWidth, kHeight, 1000, 1000, 500, 50};
  knot.rig = some_plan().rig;
  KnotDepth depth{{kWidth, kHeight, 500, 500, 500, 50}, {}, cv::Mat1f(kHeight, kWidth, 3.0F)};
  depth.cam_from_world.t.z() = -1;               // a wider camera, nearer to a wall at 4
  depth.z.colRange(0, 100).setTo(2);             // stands beside the knot's picture
  depth.z.colRange(400, 500).setTo(0);           // unknown
  depth.z(cv::Rect(500, 40, 100, 20)).setTo(1);  // at 2
  const DisparityHistogram scene = scene_disparities(knot, std::vector<KnotDepth>{depth});
  EXPECT_NEAR(scene.quantile(0.5), 100 / 4.0 - 20, 0.5);
  EXPECT_NEAR(scene.quantile(0.001), 100 / 4.0 - 20, 0.5);
  EXPECT_NEAR(scene.quantile(0.999), 100 / 2.0 - 20, 0.5);
  // A column of the wall is 1.5 wide in the knot's picture, whose 1000 columns thus see 667, 100 of them unknown.
  EXPECT_NEAR(1 - scene.share_below(20), 100.0 * 20 / (100.0 * (1000 - 150)), 0.01);
  depth.z.setTo(0);
  EXPECT_TRUE(scene_disparities(knot, std::vector<KnotDepth>{depth}).empty());
}

}  // namespace
}  // namespace vantage
