#include "jobs/align/readout.h"

#include <gtest/gtest.h>

#include <random>

namespace vantage::align {
namespace {

/// A pair's normal equations as samples at random rows give them. same_rows: both cameras see each point at one height.
PairShutter pair_of(const std::string& a, const std::string& b, double readout_a_s, double readout_b_s, bool same_rows,
                    std::mt19937& random) {
  std::uniform_real_distribution<double> row(-0.5, 0.5), slope(-300, 300);
  std::normal_distribution<double> noise_px(0, 0.5);
  PairShutter pair{.a = a, .b = b};
  for (int k = 0; k < 3000; ++k) {
    const double row_a = row(random), row_b = same_rows ? row_a : row(random);
    const Eigen::Vector3d J = slope(random) * Eigen::Vector3d(1, -row_a, row_b);
    const double r = J.dot(Eigen::Vector3d(0.004, readout_a_s, readout_b_s)) + noise_px(random);
    pair.H += J * J.transpose() / 0.25;
    pair.g += J * r / 0.25;
  }
  return pair;
}

const std::vector<ShutterCamera> kCameras = {{"left", 0.04}, {"middle", 0.04}, {"right", 1 / 30.}};

TEST(Readout, FoundFromAllPairsAtOnce) {
  std::mt19937 random(2);
  const std::vector<PairShutter> pairs = {pair_of("left", "middle", 0.018, 0, false, random),
                                          pair_of("left", "right", 0.018, 0.03, false, random),
                                          pair_of("middle", "right", 0, 0.03, false, random)};
  const auto found = estimate_readouts(pairs, kCameras);
  const double truth_s[] = {0.018, 0, 0.03};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(found[k].readout_s, truth_s[k], 0.001) << found[k].camera;
    EXPECT_LT(found[k].std_s, 0.001);
    EXPECT_LT(std::abs(found[k].readout_s - truth_s[k]), 3 * found[k].std_s);
  }
}

TEST(Readout, OnePairThatSeesPointsAtOneHeightTellsOnlyTheDifference) {
  std::mt19937 random(2);
  const std::vector<PairShutter> pairs = {pair_of("left", "middle", 0.018, 0.018, true, random)};
  for (const Readout& r : estimate_readouts(pairs, kCameras)) EXPECT_LT(r.readout_s, 3 * r.std_s) << r.camera;
}

TEST(Readout, StaysWithinAFrame) {
  std::mt19937 random(2);
  const std::vector<PairShutter> pairs = {pair_of("left", "middle", 0.09, -0.02, false, random)};
  const auto found = estimate_readouts(pairs, kCameras);
  EXPECT_DOUBLE_EQ(found[0].readout_s, 0.04);
  EXPECT_DOUBLE_EQ(found[1].readout_s, 0);
}

}  // namespace
}  // namespace vantage::align
