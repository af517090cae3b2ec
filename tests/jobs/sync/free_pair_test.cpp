#include "jobs/sync/free_pair.h"

#include <gtest/gtest.h>

#include "tests/jobs/sync/moving_points.h"

namespace vantage::sync {
namespace {

using namespace testing_support;
constexpr VerdictLimits kLimits{.frame_s = 1 / kFps};

struct Answered {
  FreePairAnswer answer;
  PairOffset offset;
  double error_frames(double true_offset_s) const { return (offset.offset_s - true_offset_s) * kFps; }
};

Answered solve(const Rig& rig, std::vector<PathPair> pairs, double max_offset_s = 10) {
  FreePairInput in{.pairs = std::move(pairs), .still = {}, .range = {}, .lens_a = {}, .lens_b = {}};
  in.range = plausible_offsets(rig.table_a, rig.table_b, max_offset_s);
  in.frame_s = 1 / kFps;
  in.width_a_px = rig.table_a.width;
  Answered out{solve_free_pair(in), {}};
  judge_free_pair(out.offset, out.answer, kLimits);
  return out;
}

TEST(FreePair, SubframeWithoutCalibrationWithNoiseAndWrongTracks) {
  const Rig rig = make_rig(90);
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const double offset_s = (-14.3 + 7.77 * seed) / kFps;
    const auto out = solve(
        rig, make_pairs(rig, {.num = 40, .offset_s = offset_s, .noise_px = 0.3, .wrong_share = 0.2, .seed = seed}));
    EXPECT_TRUE(out.offset.determined) << out.offset.verdict;
    EXPECT_LT(std::abs(out.error_frames(offset_s)), 0.05) << "seed " << seed;
    EXPECT_LT(std::abs(out.error_frames(offset_s)), 4 * out.offset.std_s * kFps) << "seed " << seed;
  }
}

TEST(FreePair, LevelMotionBeforeLevelCamerasIsNeverAnsweredWrongly) {
  const Rig rig = make_rig(60, true);
  for (unsigned seed = 1; seed <= 50; ++seed) {
    const auto out =
        solve(rig,
              make_pairs(
                  rig, {.num = 30, .offset_s = 6.4 / kFps, .noise_px = 0.3, .kind = Kind::AlongBaseline, .seed = seed}),
              0.5);
    EXPECT_FALSE(out.offset.determined) << "seed " << seed << ": " << out.offset.verdict;
  }
}

TEST(FreePair, PeriodicMotionHasMoreThanOneAnswer) {
  const Rig rig = make_rig(90);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto out = solve(
        rig,
        make_pairs(rig, {.num = 30, .offset_s = 3.4 / kFps, .noise_px = 0.3, .kind = Kind::Periodic, .seed = seed}), 2);
    EXPECT_FALSE(out.offset.determined) << "seed " << seed << ": " << out.offset.verdict;
  }
}

TEST(FreePair, CameraThatSeesSomethingElseIsNotAnswered) {
  const Rig rig = make_rig(90);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto out = solve(rig, make_pairs(rig, {.num = 30, .noise_px = 0.3, .wrong_share = 1, .seed = seed}), 1);
    EXPECT_FALSE(out.offset.determined) << "seed " << seed << ": " << out.offset.verdict;
  }
}

}  // namespace
}  // namespace vantage::sync
