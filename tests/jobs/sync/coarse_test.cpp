#include <gtest/gtest.h>

#include <cmath>

#include "jobs/sync/audio_offset.h"
#include "jobs/sync/motion_codes.h"
#include "jobs/sync/sync_job.h"
#include "tests/jobs/sync/moving_points.h"

namespace vantage::sync {
namespace {

using namespace testing_support;

/// Lists for the functions that take tracks and matches; every pair is a match, and so is a wrong partner for each.
struct Lists {
  std::vector<TimedTrack> a, b;
  std::vector<TrackMatch> matches;
};
Lists lists_of(const std::vector<PathPair>& pairs) {
  Lists lists;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    lists.a.push_back(pairs[k].a);
    lists.b.push_back(pairs[k].b);
    lists.matches.push_back({k, k, 0.3, true});
    lists.matches.push_back({k, (k + 1) % pairs.size(), 0.6, false});
  }
  return lists;
}

/// A ball that bounces at moments of its own: what extremal points are made for.
TimedTrack bouncing(double offset_s, int num_frames, unsigned seed, double tilt) {
  std::vector<double> times;
  std::vector<Eigen::Vector2d> px;
  for (int f = 0; f < num_frames; ++f) {
    std::mt19937 random(seed);
    const double now = offset_s + f / kFps;
    double begin = -2, length = 0;
    do begin += length, length = 0.25 + 0.5 * static_cast<double>(random() % 1000) / 1000;
    while (begin + length <= now);
    const double height = 400 * length * length * 4 * (now - begin) * (begin + length - now) / (length * length);
    times.push_back(f / kFps);
    px.emplace_back(100 + 20 * now + tilt * height, 300 - height);
  }
  return {times, px};
}

TEST(DouglasPeucker, KeepsCornersAndTurnsOnALine) {
  const std::vector<Eigen::Vector2d> corner = {{0, 0}, {1, 0.01}, {2, 0}, {2, 1}, {2.01, 2}};
  EXPECT_EQ(douglas_peucker(corner, 0.1), (std::vector<bool>{true, false, true, false, true}));
  const std::vector<Eigen::Vector2d> swing = {{0, 0}, {2, 0}, {4, 0}, {3, 0}, {1, 0}};
  EXPECT_EQ(douglas_peucker(swing, 0.1), (std::vector<bool>{true, false, true, false, true}));
}

TEST(MotionCodes, EpsilonIsFoundForTheShareThatShallStay) {
  const TimedTrack ball = bouncing(0, 90, 4, 0.1);
  std::vector<Eigen::Vector2d> path;
  for (std::size_t k = 0; k < ball.size(); ++k) path.push_back(ball.px(k));
  for (const double share : {0.1, 0.2, 0.3}) {
    const auto code = motion_code(path, share);
    const auto ones = static_cast<double>(std::count(code.begin(), code.end(), 1));
    EXPECT_NEAR(ones / 90, share, 0.06);
  }
}

TEST(MotionCodes, StringMatchingRecoversAWholeFrameShift) {
  const OffsetRange range{-1.5, 1.5, 0.5 / kFps};
  for (const int shift : {-17, -4, 0, 7, 22}) {
    Lists lists;
    for (unsigned ball = 0; ball < 8; ++ball) {
      lists.a.push_back(bouncing(0, 90, ball, 0.1));
      // One match in four is another ball.
      lists.b.push_back(bouncing(shift / kFps, 90, ball % 4 == 3 ? ball + 50 : ball, -0.2));
      lists.matches.push_back({ball, ball, 0.3, true});
    }
    const CodeVote vote = vote_by_codes(lists.a, lists.b, lists.matches, range);
    EXPECT_NEAR(vote.offset_s * kFps, shift, 1.01);
    EXPECT_GE(vote.num_inliers, 5);
    EXPECT_GT(vote.contrast, 1.3);
  }
}

TEST(MotionCodes, NothingToMatchHasNoInliers) { EXPECT_EQ(vote_by_codes({}, {}, {}, {-1, 1, 0.01}).num_inliers, 0); }

TEST(OffsetScan, FindsTheOffsetAmongWrongMatches) {
  const Rig rig = make_rig(24);
  const auto range = plausible_offsets(rig.table_a, rig.table_b, 10);
  for (const double offset_frames : {-6.3, 0.2, 4.6}) {
    const Lists lists =
        lists_of(make_pairs(rig, {.num = 40, .offset_s = offset_frames / kFps, .noise_px = 0.3, .wrong_share = 0.3}));
    const OffsetScan scan = scan_offsets(lists.a, lists.b, lists.matches, rig.geometry(), range, 3);
    ASSERT_FALSE(scan.modes.empty());
    EXPECT_NEAR(scan.modes[0].offset_s * kFps, offset_frames, 0.51);
    EXPECT_GT(scan.contrast(), 1.3);
  }
}

TEST(OffsetScan, PeriodicMotionHasSeveralModes) {
  const Rig rig = make_rig(60);
  const Lists lists =
      lists_of(make_pairs(rig, {.num = 40, .offset_s = 1.3 / kFps, .noise_px = 0.3, .kind = Kind::Periodic}));
  const OffsetScan scan =
      scan_offsets(lists.a, lists.b, lists.matches, rig.geometry(), plausible_offsets(rig.table_a, rig.table_b, 10), 3);
  EXPECT_LT(scan.contrast(), 1.3);
}

TEST(OffsetScan, WrongMatchesAloneMakeNoClearMode) {
  const Rig rig = make_rig(60);
  const Lists lists = lists_of(make_pairs(rig, {.num = 40, .noise_px = 0.3, .wrong_share = 1}));
  const OffsetScan scan =
      scan_offsets(lists.a, lists.b, lists.matches, rig.geometry(), plausible_offsets(rig.table_a, rig.table_b, 10), 3);
  EXPECT_LT(scan.contrast(), 1.6);
}

TEST(OffsetScan, OnlyOffsetsWithEnoughOverlapAreTried) {
  const Rig rig = make_rig(31);  // one second
  const auto range = plausible_offsets(rig.table_a, rig.table_b, 10);
  EXPECT_NEAR(range.min_s, -0.6, 1e-9);
  EXPECT_NEAR(range.max_s, 0.6, 1e-9);
  EXPECT_EQ(plausible_offsets(rig.table_a, rig.table_b, 0.1).num(), 13);
}

TEST(Identity, LooksFindTheSamePointAgain) {
  std::mt19937 random(2);
  std::vector<TimedTrack> a, b;
  for (int k = 0; k < 20; ++k) {
    TimedTrack track({0, 1}, {{0, 0}, {1, 1}});
    track.looks.resize(2);
    for (auto& look : track.looks)
      for (auto& d : look) d = static_cast<std::uint8_t>(random() % 120);
    a.push_back(track);
    for (auto& d : track.looks[1]) d = static_cast<std::uint8_t>(d + random() % 20);
    b.insert(b.begin(), track);
  }
  const auto matches = match_by_look(a, b, 1, 0.9);
  ASSERT_EQ(matches.size(), 20U);
  for (const auto& m : matches) {
    EXPECT_EQ(m.b, 19 - m.a);
    EXPECT_TRUE(m.mutual);
  }
}

Envelope noise_envelope(unsigned seed, int first, int num) {
  std::mt19937 random(seed);
  std::vector<double> rms;
  for (int k = 0; k < first + num; ++k) {
    const double burst = random() % 20 == 0 ? 0.5 : 0.0;
    const double level = 0.1 + burst + static_cast<double>(random() % 100) / 1000;
    if (k >= first) rms.push_back(level);
  }
  return {100, rms};
}

TEST(Audio, RecoversTheLagOfTheSameSound) {
  // b begins 0.73 s after a: its first sample is a's 73rd.
  const auto found = correlate_envelopes(noise_envelope(1, 100, 800), noise_envelope(1, 173, 600), 5);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->offset_s, 0.73, 0.005);
  EXPECT_GT(found->correlation, 0.95);
  EXPECT_GT(found->contrast, 1.5);
}

TEST(Audio, OtherSoundDoesNotCorrelate) {
  const auto found = correlate_envelopes(noise_envelope(1, 0, 800), noise_envelope(2, 0, 800), 5);
  if (found) {
    EXPECT_LT(found->correlation, 0.5);
  }
}

TEST(Audio, SilenceHasNoOffset) {
  EXPECT_FALSE(correlate_envelopes({100, std::vector<double>(500, 0.0)}, noise_envelope(1, 0, 500), 5));
}

TEST(SyncSplit, EveryPairOnceAndNoneWhenClocksAreKnown) {
  Shot shot;
  for (const std::string name : {"left", "middle", "right"}) {
    ShotCamera camera;
    camera.name = name;
    shot.cameras.push_back(camera);
  }
  const ShotState state(shot, [](const std::string&) { return std::nullopt; });
  const auto units = SyncJob::split(state, {});
  ASSERT_EQ(units.size(), 3U);
  EXPECT_EQ(units[0].name, "sync/left__middle");
  EXPECT_EQ(units[2].name, "sync/middle__right");
  SyncJob::Params params;
  params.method = "known";
  EXPECT_TRUE(SyncJob::split(state, params).empty());
  params.method = "audio";
  EXPECT_EQ(SyncJob::split(state, params)[0].needs, (std::vector<std::string>{"ingest/left", "ingest/middle"}));
}

}  // namespace
}  // namespace vantage::sync
