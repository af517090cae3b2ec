/// Footage that gives no answer, or hides it: with and without calibration the solver is right or says that it cannot
/// tell.
#include <gtest/gtest.h>

#include "jobs/sync/free_pair.h"
#include "tests/jobs/sync/moving_points.h"

namespace vantage::sync {
namespace {

using namespace testing_support;

/// Poses unknown, offsets within ±max_offset_s.
PairOffset solve(const FrameTable& table_a, const FrameTable& table_b, std::vector<PathPair> pairs,
                 double max_offset_s = 10) {
  FreePairInput in{.pairs = std::move(pairs), .still = {}, .range = {}, .lens_a = {}, .lens_b = {}};
  in.range = plausible_offsets(table_a, table_b, max_offset_s);
  in.frame_s = std::max(frame_interval_s(table_a), frame_interval_s(table_b));
  in.width_a_px = table_a.width;
  PairOffset offset;
  judge_free_pair(offset, solve_free_pair(in), {.frame_s = in.frame_s});
  return offset;
}

void set_times(FrameTable& table, int num, double fps) {
  table.pts_s.clear();
  for (int k = 0; k < num; ++k) table.pts_s.push_back(k / fps);
}

TEST(HardFootage, NoMotionIsNotAnswered) {
  const Rig rig = make_rig(60);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto pairs = make_pairs(rig, {.num = 30, .noise_px = 0.3, .kind = Kind::Still, .seed = seed});
    const PairOffset free = solve(rig.table_a, rig.table_b, pairs, 0.5);
    EXPECT_FALSE(free.determined) << free.verdict;
    const auto fit = fit_offset(pairs, rig.geometry(), 0, 2 / kFps);
    EXPECT_TRUE(!fit || fit->std_s * kFps > 0.25) << "calibrated: ± " << fit->std_s * kFps << " frame";
  }
}

TEST(HardFootage, ClocksEightSecondsApart) {
  const Rig rig = make_rig(360);  // 12 s, of which 4 are common
  const double offset_s = 8.013;
  const PairOffset offset = solve(
      rig.table_a, rig.table_b,
      make_pairs(rig, {.num = 20, .offset_s = offset_s, .noise_px = 0.3, .wrong_share = 0.2, .kind = Kind::Wandering}));
  EXPECT_TRUE(offset.determined) << offset.verdict;
  EXPECT_NEAR(offset.offset_s * kFps, offset_s * kFps, 0.1) << offset.verdict;
}

TEST(HardFootage, FilmAndVideoRates) {
  Rig rig = make_rig(10);
  set_times(rig.table_a, 96, 24000.0 / 1001);
  set_times(rig.table_b, 100, 25);
  const double offset_s = -0.21;
  const PairOffset offset =
      solve(rig.table_a, rig.table_b, make_pairs(rig, {.num = 30, .offset_s = offset_s, .noise_px = 0.3}), 2);
  EXPECT_TRUE(offset.determined) << offset.verdict;
  EXPECT_NEAR(offset.offset_s * 25, offset_s * 25, 0.05) << offset.verdict;
}

TEST(HardFootage, VariableFrameRateFollowsItsTimeStamps) {
  Rig rig = make_rig(90);
  for (std::size_t k = 0; k < rig.table_b.pts_s.size(); ++k)
    rig.table_b.pts_s[k] += 0.02 * std::sin(0.4 * static_cast<double>(k));
  const PairOffset offset =
      solve(rig.table_a, rig.table_b, make_pairs(rig, {.num = 30, .offset_s = 0.117, .noise_px = 0.3}), 1);
  EXPECT_TRUE(offset.determined) << offset.verdict;
  EXPECT_NEAR(offset.offset_s * kFps, 0.117 * kFps, 0.05) << offset.verdict;
}

TEST(HardFootage, FiftyPartsInAMillionOverAMinute) {
  const Rig rig = make_rig(1800);
  std::vector<PathPair> pairs =
      make_pairs(rig, {.num = 12, .offset_s = 0.2, .rate = 1.00005, .noise_px = 0.3, .kind = Kind::Wandering});
  const PairOffset offset = solve(rig.table_a, rig.table_b, pairs, 2);
  EXPECT_TRUE(offset.determined) << offset.verdict;
  EXPECT_NEAR(offset.rate, 1.00005, 2e-5) << offset.verdict;
  EXPECT_NEAR((offset.offset_s + 30 * offset.rate) * kFps, (0.2 + 30 * 1.00005) * kFps, 0.03) << offset.verdict;
}

}  // namespace
}  // namespace vantage::sync
