#include <gtest/gtest.h>

#include "jobs/sync/nine_points.h"
#include "jobs/sync/verdict.h"
#include "tests/jobs/sync/moving_points.h"

namespace vantage::sync {
namespace {

using namespace testing_support;
constexpr VerdictLimits kLimits{.frame_s = 1 / kFps};

TEST(TimedTrack, PassesThroughItsPointsAndFollowsAParabolaExactly) {
  const std::vector<double> times = {0, 0.03, 0.07, 0.1, 0.14};
  std::vector<Eigen::Vector2d> px;
  const auto parabola = [](double t) { return Eigen::Vector2d(3 + 20 * t - 300 * t * t, 7 + 50 * t * t); };
  for (const double t : times) px.push_back(parabola(t));
  const TimedTrack track(times, px);
  for (double t = 0; t <= 0.14; t += 0.005) EXPECT_LT((*track.at(t) - parabola(t)).norm(), 1e-9) << t;
  EXPECT_FALSE(track.at(-0.01));
  EXPECT_FALSE(track.at(0.15));
}

TEST(PairGeometry, TruePairsLieOnTheirEpipolarLines) {
  const Rig rig = make_rig(3);
  const auto geometry = rig.geometry();
  const Eigen::Vector3d X(0.3, -0.2, 0.4);
  EXPECT_NEAR(*geometry.residual_px(rig.project("a", X), 0, rig.project("b", X), 0), 0, 1e-9);
  EXPECT_GT(std::abs(*geometry.residual_px(rig.project("a", X), 0, rig.project("b", X) + Eigen::Vector2d(0, 5), 0)), 2);
}

TEST(PairGeometry, MovingCamerasPoseIsInterpolatedBetweenFrames) {
  Rig rig = make_rig(2);
  rig.calibration.cam_from_world[{"b", 1}].t += Eigen::Vector3d(0.1, 0.2, 0);
  const PairGeometry geometry(CameraPath(rig.calibration, rig.table_a, false),
                              CameraPath(rig.calibration, rig.table_b, true));
  RigidTransform between = rig.calibration.pose({"b", 0});
  between.t += Eigen::Vector3d(0.05, 0.1, 0);
  const Eigen::Vector3d X(0.3, -0.2, 0.4);
  const Eigen::Vector2d b = rig.calibration.camera("b").pinhole.project(between * X);
  EXPECT_NEAR(*geometry.residual_px(rig.project("a", X), 0, b, 0.5 / kFps), 0, 1e-6);
  EXPECT_FALSE(geometry.residual_px(rig.project("a", X), 0, b, 2)) << "no pose is known that late";
}

TEST(NinePoints, FindsTheExactFractionOfStraightNoiseFreeMotion) {
  const Rig rig = make_rig(1);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const double fraction : {0.37, 0.0, 0.93, -0.5}) {
    std::vector<MovingSample> nine;
    for (int k = 0; k < 9; ++k) {
      const Eigen::Vector3d X(uniform(random), 0.6 * uniform(random), uniform(random));
      const Eigen::Vector2d step(20 * uniform(random), 20 * uniform(random)), b = rig.project("b", X);
      nine.push_back({rig.project("a", X), b - fraction * step, b + (1 - fraction) * step});
    }
    double nearest = 9;
    for (const SubframeRoot& root : solve_nine_points(nine, 2)) {
      if (std::abs(root.fraction - fraction) > std::abs(nearest - fraction)) continue;
      nearest = root.fraction;
      for (const auto& s : nine)
        EXPECT_LT(std::abs(sampson_px(root.F, s.a, s.b0 + root.fraction * (s.b1 - s.b0))), 1e-4);
    }
    EXPECT_NEAR(nearest, fraction, 1e-6);
  }
}

TEST(NinePoints, VoteStaysNearTheTruthWithNoiseAndWrongTracks) {
  const Rig rig = make_rig(24);
  for (const unsigned seed : {1U, 2U, 3U}) {
    const double offset_frames = 2.37;
    const auto pairs = make_pairs(
        rig, {.num = 60, .offset_s = offset_frames / kFps, .noise_px = 0.3, .wrong_share = 0.2, .seed = seed});
    const auto vote =
        align_by_nine_points({.pairs = pairs, .still = {}, .table_a = rig.table_a, .frame_b_s = 1 / kFps}, 3 / kFps);
    ASSERT_TRUE(vote);
    EXPECT_NEAR(vote->offset_s * kFps, offset_frames, 0.05) << "seed " << seed;
    EXPECT_LT(vote->std, 0.25);
  }
}

TEST(EpipolarFit, ExactOnExactPaths) {
  const Rig rig = make_rig(24);
  const auto fit = fit_offset(make_pairs(rig, {.offset_s = 2.37 / kFps}), rig.geometry(), 2 / kFps, 2 / kFps);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->offset_s * kFps, 2.37, 2e-3);
}

TEST(EpipolarFit, SubframeWithNoiseAndWrongTracksAndHonestAboutIt) {
  const Rig rig = make_rig(24);
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const double offset_frames = -3.2 + 0.87 * seed;
    const auto pairs = make_pairs(
        rig, {.num = 40, .offset_s = offset_frames / kFps, .noise_px = 0.3, .wrong_share = 0.2, .seed = seed});
    const auto fit = fit_offset(pairs, rig.geometry(), std::round(offset_frames) / kFps, 2 / kFps);
    ASSERT_TRUE(fit);
    const double error_frames = fit->offset_s * kFps - offset_frames;
    EXPECT_LT(std::abs(error_frames), 0.05) << "seed " << seed;
    EXPECT_LT(std::abs(error_frames), 3 * fit->std_s * kFps) << "seed " << seed;
    PairOffset offset;
    judge_fit(offset, fit, 5, "points", kLimits);
    EXPECT_TRUE(offset.determined) << offset.verdict;
  }
}

TEST(EpipolarFit, MotionAlongTheBaselineIsNeverAnswered) {
  const Rig rig = make_rig(24, true);
  for (unsigned seed = 1; seed <= 50; ++seed) {
    const auto pairs = make_pairs(
        rig, {.num = 40, .offset_s = 1.4 / kFps, .noise_px = 0.3, .kind = Kind::AlongBaseline, .seed = seed});
    PairOffset offset;
    judge_fit(offset, fit_offset(pairs, rig.geometry(), 1 / kFps, 2 / kFps), 5, "points", kLimits);
    EXPECT_FALSE(offset.determined) << "seed " << seed << ": " << offset.verdict;
  }
}

TEST(EpipolarFit, DriftingClockIsFoundOverAMinute) {
  const Rig rig = make_rig(1800);
  const auto pairs =
      make_pairs(rig, {.num = 12, .offset_s = 0.2, .rate = 1.0002, .noise_px = 0.3, .kind = Kind::Periodic});
  const auto fit = fit_offset(pairs, rig.geometry(), 0.21, 2 / kFps, {.estimate_rate = true});
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->rate, 1.0002, 2e-5);
  EXPECT_NEAR(fit->offset_s, 0.2, 0.02 / kFps);
}

TEST(Verdict, SaysWhyAnOffsetIsNotBelieved) {
  PairOffset offset;
  judge_fit(offset, OffsetFit{.offset_s = 1, .std_s = 0.02, .effective_tracks = 30}, 5, "points", kLimits);
  EXPECT_FALSE(offset.determined) << "0.6 frame";
  judge_fit(offset, OffsetFit{.offset_s = 1, .std_s = 0.001, .effective_tracks = 3}, 5, "points", kLimits);
  EXPECT_FALSE(offset.determined) << "three tracks";
  judge_fit(offset, OffsetFit{.offset_s = 1, .std_s = 0.001, .effective_tracks = 30}, 1.1, "points", kLimits);
  EXPECT_FALSE(offset.determined) << "two modes";
  judge_fit(offset, OffsetFit{.offset_s = 1, .std_s = 0.001, .effective_tracks = 30}, 5, "points", kLimits);
  EXPECT_TRUE(offset.determined);
}

}  // namespace
}  // namespace vantage::sync
