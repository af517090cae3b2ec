#include "jobs/sync/time_jumps.h"

#include <gtest/gtest.h>

#include "tests/jobs/sync/moving_points.h"

namespace vantage::sync {
namespace {

using namespace testing_support;

/// Tracks of a second each, as trackers give them, of points that move on: camera b loses `lost` frames at lost_at_s
/// and stamps what follows as if it had not.
std::vector<PathPair> pairs_with_loss(const Rig& rig, int lost, double lost_at_s, unsigned seed) {
  std::vector<PathPair> pairs;
  for (const PathPair& whole : make_pairs(
           rig,
           {.num = 10, .offset_s = 0.05, .noise_px = 0.3, .wrong_share = 0.2, .kind = Kind::Periodic, .seed = seed})) {
    std::vector<double> times_b;
    std::vector<Eigen::Vector2d> px_b;
    for (std::size_t k = 0; k + static_cast<std::size_t>(lost) < whole.b.size(); ++k) {
      const bool after = whole.b.time_s(k) > lost_at_s;
      times_b.push_back(whole.b.time_s(k));
      px_b.push_back(whole.b.px(after ? k + static_cast<std::size_t>(lost) : k));
    }
    const TimedTrack b(times_b, px_b);
    for (std::size_t first = 0; first + 30 <= whole.a.size(); first += 30) {
      std::vector<double> times;
      std::vector<Eigen::Vector2d> px;
      for (std::size_t k = first; k < first + 30; ++k) times.push_back(whole.a.time_s(k)), px.push_back(whole.a.px(k));
      pairs.push_back({TimedTrack(times, px), b});
    }
  }
  return pairs;
}

std::optional<TimeJump> find(const Rig& rig, const std::vector<PathPair>& pairs, double offset_s) {
  return find_time_jump({.pairs = pairs,
                         .residual = residual_by(rig.geometry()),
                         .offset_s = offset_s,
                         .std_px = 0.6,
                         .frame_a_s = 1 / kFps,
                         .frame_b_s = 1 / kFps});
}

TEST(TimeJumps, FindsALostFrameWhenAndOfWhichCamera) {
  const Rig rig = make_rig(240);
  for (unsigned seed = 1; seed <= 3; ++seed)
    for (const int lost : {1, 2}) {
      const auto pairs = pairs_with_loss(rig, lost, 5.2, seed);
      const auto jump = find(rig, pairs, 0.05 + 0.3 / kFps);  // a fit that lies between the two
      ASSERT_TRUE(jump) << "seed " << seed;
      EXPECT_EQ(jump->frames_lost, lost);
      EXPECT_TRUE(jump->lost_by_b);
      EXPECT_TRUE(jump->longer_is_before);
      EXPECT_NEAR(jump->time_b_s, 5.2, 0.6);
      EXPECT_NE(describe(*jump, "left", "right").find("right lost"), std::string::npos);
    }
}

TEST(TimeJumps, NoneWhereNothingWasLost) {
  const Rig rig = make_rig(240);
  for (unsigned seed = 1; seed <= 5; ++seed)
    EXPECT_FALSE(find(rig, pairs_with_loss(rig, 0, 5.2, seed), 0.05)) << "seed " << seed;
}

TEST(TimeJumps, DriftIsNoJump) {
  const Rig rig = make_rig(240);
  for (const double rate : {1.001, 1.006}) {
    const auto pairs =
        make_pairs(rig, {.num = 20, .offset_s = 0.05, .rate = rate, .noise_px = 0.3, .kind = Kind::Periodic});
    EXPECT_FALSE(find(rig, pairs, 0.05 + 4 * (rate - 1))) << rate;
  }
}

}  // namespace
}  // namespace vantage::sync
