#include <gtest/gtest.h>

#include "jobs/sync/evidence.h"
#include "jobs/sync/motion_offset.h"
#include "tests/jobs/sync/moving_spheres.h"

namespace vantage::sync {
namespace {

using namespace testing_support;
using Side = EpipolarPencil::Side;

FrontierAnswer answer_for(const Rig& rig, const std::vector<Sphere>& spheres, double offset_s, double rate = 1) {
  const FrontierInput in{rig.geometry().pencil(), film(rig, rig.table_a, spheres, 0),
                         film(rig, rig.table_b, spheres, offset_s, rate)};
  return offset_from_frontiers(in, rig.table_a, rig.table_b, rig.geometry(),
                               plausible_offsets(rig.table_a, rig.table_b, 10));
}

TEST(EpipolarPencil, BothCamerasReadOnePlaneOffTheirPixels) {
  const Rig rig = make_wide_rig(1, 55);
  const EpipolarPencil pencil = rig.geometry().pencil();
  ASSERT_TRUE(pencil.usable());
  for (const Eigen::Vector3d& X : {Eigen::Vector3d(0.3, -0.5, 0.4), Eigen::Vector3d(-0.6, 0.7, -0.4)}) {
    const double angle = pencil.angle_rad(Side::A, rig.project("a", X));
    EXPECT_NEAR(angle, pencil.angle_rad(Side::B, rig.project("b", X)), 1e-9);
    const auto px = pencil.pixel_of(Side::B, angle, {320, 180});
    ASSERT_TRUE(px);
    EXPECT_NEAR(pencil.angle_rad(Side::B, *px), angle, 1e-9);
  }
}

TEST(EpipolarPencil, CamerasThatSeeEachOtherHaveNoUse) {
  EXPECT_FALSE(make_wide_rig(1, 178).geometry().pencil().usable());
}

TEST(Frontier, IsWhereThePlaneTouchesTheSphere) {
  const Rig rig = make_wide_rig(20, 55);
  const EpipolarPencil pencil = rig.geometry().pencil();
  const Sphere sphere = two_spheres()[0];
  const auto found = find_frontiers(film(rig, rig.table_a, {sphere}, 0), rig.table_a, pencil, Side::A);
  ASSERT_EQ(found.size(), 2U) << "one on each side";
  const Eigen::Vector3d a = rig.calibration.pose({"a", 0}).centre(), b = rig.calibration.pose({"b", 0}).centre();
  for (std::size_t k = 0; k < 20; k += 5) {
    // The touching planes lie asin(radius / distance from the baseline) to either side of the one through the centre.
    const Eigen::Vector3d c = sphere.centre(rig.table_a.pts_s[k]);
    const double distance = (c - a).cross((b - a).normalized()).norm();
    const double middle = pencil.angle_rad(Side::A, rig.project("a", c)), half = std::asin(sphere.radius / distance);
    for (const Frontier& f : found)
      EXPECT_NEAR(f.angles_rad[k], middle + (f.upper ? half : -half), 4 * f.rad_per_px) << "two cells";
  }
}

TEST(Outlines, TellTheOffsetOfCamerasFarApartToAFewHundredthsOfAFrame) {
  for (const double apart_deg : {20.0, 60.0, 100.0})
    for (const double offset_frames : {7.37, -12.8}) {
      const Rig rig = make_wide_rig(60, apart_deg);
      const auto answer = answer_for(rig, two_spheres(), offset_frames / kFps);
      ASSERT_FALSE(answer.scan.modes.empty());
      EXPECT_NEAR(answer.scan.modes[0].offset_s * kFps, offset_frames, 1) << apart_deg;
      EXPECT_GT(answer.scan.contrast(), 1.3) << apart_deg;
      ASSERT_TRUE(answer.fit) << apart_deg;
      const double at_pivot =
          answer.fit->offset_s + (answer.fit->rate - 1) * answer.fit->pivot_b_s;  // any rate error turns about it
      EXPECT_NEAR(at_pivot * kFps, offset_frames, 0.08) << apart_deg;
      EXPECT_LT(std::abs(at_pivot - offset_frames / kFps), 4 * answer.fit->std_s) << apart_deg;
    }
}

TEST(Outlines, RateOfAWrongFrameRateIsFound) {
  const Rig rig = make_wide_rig(150, 60);
  const auto answer = answer_for(rig, two_spheres(), 0.21, 1 / 1.01);
  ASSERT_TRUE(answer.fit);
  EXPECT_NEAR(answer.fit->rate, 1 / 1.01, 1e-3);
  EXPECT_GT(std::abs(answer.fit->rate - 1), 4 * answer.fit->rate_std);
}

/// A swing of 0.8 s.
std::vector<Sphere> pendulum() {
  return {{0.2, [](double t) -> Eigen::Vector3d { return {0.1, 0.7 * std::sin(2 * M_PI * t / 0.8), 0}; }}};
}

TEST(Outlines, PendulumFitsAtEveryPeriod) {
  EXPECT_LT(answer_for(make_wide_rig(120, 60), pendulum(), 0.3).scan.contrast(), 1.3);
}

TEST(Sound, SaysWhichSwingOfAPendulumItIs) {
  const Rig rig = make_wide_rig(120, 60);
  MotionInput in;
  in.table_a = rig.table_a, in.table_b = rig.table_b;
  in.geometry = rig.geometry();
  in.outlines = FrontierInput{rig.geometry().pencil(), film(rig, rig.table_a, pendulum(), 0),
                              film(rig, rig.table_b, pendulum(), 1.1)};
  SyncJob::Params params;
  params.min_tracks = 2;
  EXPECT_FALSE(offset_from_motion(in, params).offset.determined);
  in.sound = AudioOffset{.offset_s = 1.16, .std_s = 0.01, .correlation = 0.9, .contrast = 2};
  const PairOffset told = offset_from_motion(in, params).offset;
  ASSERT_TRUE(told.determined) << told.verdict;
  EXPECT_NEAR(told.offset_s + (told.rate - 1) * told.pivot_b_s, 1.1, 0.01) << told.verdict;
  in.sound->offset_s = 40;  // no part of the clips overlaps there
  EXPECT_FALSE(offset_from_motion(in, params).offset.determined);
}

TEST(Outlines, NothingThatMovesHasNoOffset) {
  const Rig rig = make_wide_rig(30, 60);
  const auto answer = answer_for(rig, {}, 0.1);
  EXPECT_TRUE(answer.scan.modes.empty());
  EXPECT_FALSE(answer.fit);
}

TEST(Evidence, AgreeingCuesAreSurerTogetherAndOddOnesAreHeard) {
  const double frame_s = 0.04;
  const Evidence points{"points", OffsetFit{.offset_s = 1.000, .std_s = 0.002, .effective_tracks = 9}, 1.2, 5};
  Evidence outlines{"outlines", OffsetFit{.offset_s = 1.004, .std_s = 0.004, .effective_tracks = 2}, 1.2, 1.5};
  const Combined both = combine(points, outlines, frame_s, 1.3);
  EXPECT_NEAR(both.fit->offset_s, 1.0008, 1e-9) << "weighed by 1 / σ²";
  EXPECT_LT(both.fit->std_s, 0.002);
  EXPECT_GT(both.contrast, 1.3);

  outlines.fit->offset_s = 2;
  outlines.contrast = 3;
  const Combined surer = combine(points, outlines, frame_s, 1.3);
  EXPECT_EQ(surer.cues, "outlines");
  EXPECT_TRUE(surer.disagreement.empty());

  Evidence sure_points = points;
  sure_points.contrast = 2;
  EXPECT_FALSE(combine(sure_points, outlines, frame_s, 1.3).disagreement.empty());
}

}  // namespace
}  // namespace vantage::sync
