#include "jobs/align/joint_tracks.h"

#include <gtest/gtest.h>

namespace vantage::align {
namespace {

constexpr double kFrameS = 0.1;

JointCamera camera(const std::string& name, double offset_s) {
  return {.lens = {100, 100, 100, 100, 50, 50},
          .cam_from_world = {},
          .clock = {name, offset_s, 1, 0},
          .frame_s = kFrameS,
          .middle_s = 0.5};
}

/// One track of ten frames at (40, 75); rows are read out in 0.02 s.
CameraTracks ten_frames(const std::string& name) {
  CameraTracks out{{name, 100, 100, {}}, {name, 100, 100, 1 / kFrameS, {}}, 0.02};
  for (int f = 0; f < 10; ++f) out.table.pts_s.push_back(f * kFrameS);
  out.tracks.tracks.push_back({.first_frame = 0, .px = {10, Eigen::Vector2f(40, 75)}, .looks = {}});
  return out;
}

TEST(JoinTracks, MatchedTracksAreMovedOntoOnePointAndKeepWhatOthersSee) {
  // b starts 0.5 s after a: five frames of each are shared, and one beyond either end.
  const std::vector<JointCamera> cameras{camera("a", 0), camera("b", 0.5), camera("c", 0.5)};
  const std::vector<CameraTracks> tracks{ten_frames("a"), ten_frames("b"), ten_frames("c")};
  const std::vector<PairTracks> pairs{{0, 1, {{0, 0, {0, 0}, {9, 0}}}}, {0, 2, {{0, 0, {0, 1}, {0, 1}}}}};
  const auto points = join_tracks(cameras, tracks, pairs, 10);
  ASSERT_EQ(points.size(), 1U);
  ASSERT_EQ(points[0].tracks.size(), 3U);
  const MovingTrack &a = points[0].tracks[0], &b = points[0].tracks[1], &c = points[0].tracks[2];
  EXPECT_EQ(a.camera, 0U);
  EXPECT_NEAR(a.times_s.front(), 0.4 + 0.02 * 0.25, 1e-9);  // row 75 of 100 is a quarter of the read-out late
  EXPECT_EQ(a.px.front(), Eigen::Vector2d(40, 75));
  EXPECT_EQ(b.px.size(), 10U);  // c sees it, too
  EXPECT_NEAR(b.px[3].x(), 43, 0.1);
  EXPECT_NEAR(c.px[3].y(), 76, 1e-9);
}

TEST(JoinTracks, ATrackIsOfOnePointOnly) {
  const std::vector<JointCamera> cameras{camera("a", 0), camera("b", 0)};
  std::vector<CameraTracks> tracks{ten_frames("a"), ten_frames("b")};
  tracks[0].tracks.tracks.push_back(tracks[0].tracks.tracks[0]);
  const std::vector<PairTracks> pairs{{0, 1, {{0, 0, {0, 0}, {0, 0}}, {1, 0, {0, 0}, {0, 0}}}}};
  EXPECT_EQ(join_tracks(cameras, tracks, pairs, 10).size(), 1U);
}

}  // namespace
}  // namespace vantage::align
