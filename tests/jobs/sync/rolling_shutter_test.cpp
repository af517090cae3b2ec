#include <gtest/gtest.h>

#include "jobs/sync/shutter_information.h"
#include "tests/jobs/sync/moving_points.h"

namespace vantage::sync {
namespace {

using namespace testing_support;
constexpr double kOffsetS = 2.37 / kFps;
constexpr int kHeightPx = 360;

struct Rolling {
  double readout_a_s = 0, readout_b_s = 0;  // of the cameras
  bool known = false;                       // whether the tracks' times say so
  double height_shift = 0;                  // points lie lower or higher than the middle
};

/// Path of a point as a rolling shutter takes it: each row at its own moment.
TimedTrack filmed(const Rig& rig, const FrameTable& table, const Motion& motion, double offset_s, double readout_s,
                  bool known, std::mt19937& random) {
  std::normal_distribution<double> noise(0, 0.2);
  std::vector<double> times;
  std::vector<Eigen::Vector2d> px;
  for (const double t : table.pts_s) {
    double delay_s = 0;
    for (int k = 0; k < 8; ++k)
      delay_s = row_delay_s(rig.project(table.camera, motion.at(offset_s + t + delay_s)).y(), kHeightPx, readout_s);
    px.push_back(rig.project(table.camera, motion.at(offset_s + t + delay_s)));
    px.back() += Eigen::Vector2d(noise(random), noise(random));
    times.push_back(t + (known ? row_delay_s(px.back().y(), kHeightPx, readout_s) : 0));
  }
  return {std::move(times), std::move(px)};
}

std::vector<PathPair> filmed_pairs(const Rig& rig, const Rolling& rolling, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<PathPair> pairs;
  for (int k = 0; k < 60; ++k) {
    Motion motion = random_motion(random, Kind::Free);
    motion.p0.y() += rolling.height_shift;
    pairs.push_back({filmed(rig, rig.table_a, motion, 0, rolling.readout_a_s, rolling.known, random),
                     filmed(rig, rig.table_b, motion, kOffsetS, rolling.readout_b_s, rolling.known, random)});
  }
  return pairs;
}

double error_frames(const Rig& rig, const Rolling& rolling) {
  const auto fit = fit_offset(filmed_pairs(rig, rolling, 5), rig.geometry(), 2 / kFps, 2 / kFps);
  EXPECT_TRUE(fit);
  return fit ? (fit->offset_s - kOffsetS) * kFps : 9;
}

TEST(RollingShutter, BiasesTheOffsetUnlessItIsKnown) {
  const Rig rig = make_rig(24);
  Rolling rolling{.readout_b_s = 0.7 / kFps, .height_shift = -1};
  EXPECT_GT(std::abs(error_frames(rig, rolling)), 0.1);
  rolling.known = true;
  EXPECT_LT(std::abs(error_frames(rig, rolling)), 0.02);
}

TEST(RollingShutter, ResidualsTellTheReadoutOfTheCameras) {
  const Rig rig = make_rig(40);
  const auto pairs = filmed_pairs(rig, {.readout_a_s = 0.2 / kFps, .readout_b_s = 0.6 / kFps}, 3);
  const auto fit = fit_offset(pairs, rig.geometry(), 2 / kFps, 2 / kFps);
  ASSERT_TRUE(fit);
  const PairShutter shutter = shutter_information({.pairs = pairs,
                                                   .residual = residual_by(rig.geometry()),
                                                   .clock = *fit,
                                                   .height_a_px = kHeightPx,
                                                   .height_b_px = kHeightPx,
                                                   .frame_b_s = 1 / kFps});
  const Eigen::Vector3d x = shutter.H.inverse() * shutter.g * kFps;
  EXPECT_NEAR(x[2] - x[1], 0.4, 0.06) << "both cameras see a point at nearly the same height: the difference is sure";
}

TEST(RollingShutter, TracksAreTimedByTheirRows) {
  TrackSet set{
      "a", 640, kHeightPx, {{.first_frame = 1, .px = {{10, 0}, {10, 180}, {10, 360}}, .moving = true, .looks = {}}}};
  set.tracks[0].looks.resize(1);
  const FrameTable table{"a", 640, kHeightPx, 25, {0, 0.04, 0.08, 0.12}};
  const auto tracks = moving_tracks(set, table, 10, 0.02);
  ASSERT_EQ(tracks.size(), 1U);
  EXPECT_NEAR(tracks[0].time_s(0), 0.04 - 0.01, 1e-12);
  EXPECT_NEAR(tracks[0].time_s(1), 0.08, 1e-12) << "a camera's time is that of its middle row";
  EXPECT_NEAR(tracks[0].time_s(2), 0.12 + 0.01, 1e-12);
}

}  // namespace
}  // namespace vantage::sync
