/// Whether offsets are as certain as they are said to be, when neighbouring points err together.
#include <gtest/gtest.h>

#include <cmath>

#include "jobs/sync/cluster_jackknife.h"
#include "jobs/sync/evidence.h"
#include "tests/jobs/sync/moving_points.h"

namespace vantage::sync {
namespace {

using namespace testing_support;

/// Things of ten neighbouring points each; b sees all points of a thing swim together by about error_px, as look-alikes
/// on a bending surface do.
std::vector<PathPair> things_that_swim(const Rig& rig, double offset_s, double error_px, unsigned seed) {
  constexpr int kThings = 8, kPoints = 10;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, 1);
  std::vector<PathPair> pairs;
  for (int thing = 0; thing < kThings; ++thing) {
    const Motion motion = random_motion(random, Kind::Free);
    const double w = 3 + std::abs(normal(random)), phase = 3 * normal(random);
    const Eigen::Vector2d swim_px = error_px * Eigen::Vector2d(normal(random), normal(random));
    for (int point = 0; point < kPoints; ++point) {
      Motion mine = motion;
      mine.p0 += 0.04 * Eigen::Vector3d(normal(random), normal(random), normal(random));
      std::vector<Eigen::Vector2d> a, b;
      for (const double t : rig.table_a.pts_s) {
        a.push_back(rig.project("a", mine.at(t)) + 0.1 * Eigen::Vector2d(normal(random), normal(random)));
        b.push_back(rig.project("b", mine.at(offset_s + t)) + swim_px * std::sin(w * t + phase) +
                    0.1 * Eigen::Vector2d(normal(random), normal(random)));
      }
      pairs.push_back({TimedTrack(rig.table_a.pts_s, a), TimedTrack(rig.table_b.pts_s, b)});
    }
  }
  return pairs;
}

TEST(Certainty, TwoThirdsOfAllOffsetsLieWithinOneStandardDeviation) {
  constexpr int kSeeds = 60;
  constexpr double kOffsetS = 0.0137;
  const Rig rig = make_rig(45);
  const PairGeometry geometry = rig.geometry();
  int num_within = 0, num_far = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const auto fit = fit_offset(things_that_swim(rig, kOffsetS, 1, seed), geometry, 0, 2 / kFps);
    ASSERT_TRUE(fit) << seed;
    const double deviation = std::abs(fit->offset_s - kOffsetS) / fit->std_s;
    num_within += deviation < 1 ? 1 : 0;
    num_far += deviation > 3 ? 1 : 0;
  }
  EXPECT_GT(num_within, 0.55 * kSeeds);
  EXPECT_LT(num_within, 0.9 * kSeeds) << "nor may they be said to be worse than they are";
  EXPECT_LE(num_far, 0.05 * kSeeds);
}

TEST(Certainty, SharedErrorOfTheCalibrationIsAFloorThatManyTracksDoNotLower) {
  const Rig rig = make_rig(45);
  const auto few = fit_offset(make_pairs(rig, {.num = 100}), rig.geometry(), 0, 2 / kFps);
  const auto many = fit_offset(make_pairs(rig, {.num = 800}), rig.geometry(), 0, 2 / kFps);
  ASSERT_TRUE(few && many);
  EXPECT_GT(many->std_s, 1e-5);
  EXPECT_LT(many->std_s, few->std_s * 1.5);
}

TEST(Certainty, LeavingOutTheClusterThatBearsTheAnswerShowsHowLittleTheRestKnows) {
  ClusterParts parts;
  const auto add = [&](long cell, double information, double score) {
    add_part(parts, {cell, 0, 0}, Eigen::MatrixXd::Constant(1, 1, information), Eigen::VectorXd::Constant(1, score));
  };
  add(0, 90, 3);
  add(1, 5, -2);
  add(2, 5, -1);
  const Eigen::MatrixXd H = Eigen::MatrixXd::Constant(1, 1, 100);
  const double sandwich = 1.5 * (3 * 3 + 2 * 2 + 1) / (100. * 100.);
  EXPECT_GT(jackknife_covariance(parts, H)(0, 0), 10 * sandwich);
  EXPECT_NEAR(effective_clusters(parts, Eigen::VectorXd::Ones(1)), 100. * 100 / (90 * 90 + 50), 1e-9);
}

TEST(Certainty, StudentsFactorFallsToOne) {
  EXPECT_NEAR(student_factor(1), 1.837, 0.01);
  EXPECT_NEAR(student_factor(2), 1.321, 0.02);
  EXPECT_NEAR(student_factor(5), 1.111, 0.01);
  EXPECT_NEAR(student_factor(1000), 1, 0.001);
  EXPECT_EQ(student_factor(0.2), student_factor(1));
}

TEST(Certainty, CuesThatDifferByMoreThanTheySayMakeTheirMeanLessCertain) {
  constexpr double kFrameS = 0.03;
  const auto cue = [](double offset_s) {
    return Evidence{"points", OffsetFit{.offset_s = offset_s, .std_s = 0.001, .effective_tracks = 9}, 3};
  };
  const double agree_s = combine(cue(0), cue(0.0005), kFrameS, 1.3).fit->std_s;
  const double differ_s = combine(cue(0), cue(0.005), kFrameS, 1.3).fit->std_s;
  EXPECT_NEAR(agree_s, 0.001 / std::sqrt(2), 1e-9);
  EXPECT_NEAR(differ_s, 0.0025, 1e-4) << "half of what they differ by";
}

}  // namespace
}  // namespace vantage::sync
