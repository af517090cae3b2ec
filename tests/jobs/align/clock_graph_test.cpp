#include "jobs/align/clock_graph.h"

#include <gtest/gtest.h>

#include <cmath>

#include "jobs/align/align_job.h"
#include "jobs/align/graph_picture.h"
#include "schema/base/error.h"
#include "schema/formats/frame_table.h"

namespace vantage::align {
namespace {

const std::vector<GraphCamera> kFive = {{"a"}, {"b"}, {"c"}, {"d"}, {"e"}};
const std::vector<double> kOffsets = {0, 0.512, -0.233, 1.75, 0.041};

PairOffset pair_of(std::size_t i, std::size_t j, double std_s) {
  return {kFive[i].name, kFive[j].name, kOffsets[j] - kOffsets[i], 1, std_s, true, "motion", 20, ""};
}
std::vector<PairOffset> all_pairs(double std_s = 0.001) {
  std::vector<PairOffset> pairs;
  for (std::size_t i = 0; i < kFive.size(); ++i)
    for (std::size_t j = i + 1; j < kFive.size(); ++j) pairs.push_back(pair_of(i, j, std_s));
  return pairs;
}
void expect_offsets(const ClockSolution& solution, double tolerance_s) {
  for (std::size_t i = 0; i < kFive.size(); ++i) {
    const CameraClock* clock = solution.clocks.find(kFive[i].name);
    ASSERT_NE(clock, nullptr) << kFive[i].name;
    EXPECT_NEAR(clock->offset_s, kOffsets[i], tolerance_s) << kFive[i].name;
  }
}

TEST(ClockGraph, ConsistentPairsGiveTheirClocks) {
  const auto solution = solve_clocks(kFive, all_pairs(), 0);
  expect_offsets(solution, 1e-9);
  EXPECT_EQ(solution.clocks.reference, "a");
  EXPECT_EQ(solution.clocks.cameras[0].offset_std_s, 0);
  EXPECT_GT(solution.clocks.cameras[1].offset_std_s, 0);
  EXPECT_LT(solution.clocks.cameras[1].offset_std_s, 0.002);
}

TEST(ClockGraph, ReferenceKeepsItsOwnStart) {
  EXPECT_DOUBLE_EQ(solve_clocks(kFive, all_pairs(), 2.5).clocks.cameras[0].offset_s, 2.5);
  EXPECT_NEAR(solve_clocks(kFive, all_pairs(), 2.5).clocks.cameras[3].offset_s, 4.25, 1e-9);
}

TEST(ClockGraph, PlantedBadPairsAreRejectedHoweverSureTheyClaimToBe) {
  for (std::size_t bad = 0; bad < all_pairs().size(); ++bad) {
    auto pairs = all_pairs();
    pairs[bad].offset_s += 0.4;
    pairs[bad].std_s = 0.0003;
    const auto solution = solve_clocks(kFive, pairs, 0);
    expect_offsets(solution, 1e-6);
    for (const auto& r : solution.residuals) EXPECT_EQ(r.rejected, r.pair == bad);
    EXPECT_NEAR(solution.residuals[bad].residual_s, 0.4, 1e-6);
  }
}

TEST(ClockGraph, UndeterminedPairsAreNotLookedAt) {
  auto pairs = all_pairs();
  pairs[2].offset_s = 77;
  pairs[2].determined = false;
  expect_offsets(solve_clocks(kFive, pairs, 0), 1e-9);
}

TEST(ClockGraph, UntiedCameraIsLeftOut) {
  auto pairs = all_pairs();
  for (auto& pair : pairs)
    if (pair.b == "e") pair.determined = false;
  const auto solution = solve_clocks(kFive, pairs, 0);
  EXPECT_EQ(solution.left_out, std::vector<std::string>{"e"});
  EXPECT_EQ(solution.clocks.cameras.size(), 4U);
}

TEST(ClockGraph, NothingDeterminedTiesNothing) {
  auto pairs = all_pairs();
  for (auto& pair : pairs) pair.determined = false;
  EXPECT_EQ(solve_clocks(kFive, pairs, 0).clocks.cameras.size(), 1U);
}

PairOffset rated(const std::string& a, const std::string& b, double offset_s, double rate, double rate_std,
                 double pivot_b_s = 0) {
  PairOffset pair{.a = a,
                  .b = b,
                  .offset_s = offset_s,
                  .rate = rate,
                  .std_s = 1e-4,
                  .determined = true,
                  .method = "",
                  .verdict = ""};
  pair.rate_std = rate_std;
  pair.pivot_b_s = pivot_b_s;
  return pair;
}

TEST(ClockGraph, RatesMultiplyAlongTheChain) {
  // t_a = 0.5 + 1.001 t_b, t_b = 0.25 + 0.999 t_c
  const auto solution =
      solve_clocks({{"a"}, {"b"}, {"c"}}, {rated("a", "b", 0.5, 1.001, 1e-6), rated("b", "c", 0.25, 0.997, 1e-6)}, 0);
  EXPECT_NEAR(solution.clocks.find("b")->rate, 1.001, 1e-8);
  EXPECT_NEAR(solution.clocks.find("c")->rate, 1.001 * 0.997, 1e-8);
  EXPECT_NEAR(solution.clocks.find("c")->offset_s, 0.5 + 1.001 * 0.25, 1e-8);
  EXPECT_GT(solution.clocks.find("c")->rate_std, solution.clocks.find("b")->rate_std);
}

TEST(ClockGraph, RateThatTooLittleFootageSaysIsNotBelieved) {
  // Two seconds, a rate of 1 ± 0.003: noise turns the pair's line about its middle, which alone is sure.
  const auto solution = solve_clocks({{"a"}, {"b"}}, {rated("a", "b", 0.5 - 0.004, 1.004, 0.003, 1)}, 0);
  EXPECT_NEAR(solution.clocks.find("b")->rate, 1, 5e-5);
  EXPECT_NEAR(solution.clocks.find("b")->offset_s, 0.5, 1e-4);
}

/// Every pair of e's says that its clock runs at `rate`, as pairs do that err by what they share: e's tracks.
ClockSolution with_rate_of_e(double rate, double rate_std) {
  std::vector<PairOffset> pairs = all_pairs();
  for (PairOffset& pair : pairs) {
    pair.rate_std = rate_std;
    if (pair.b == "e") pair.rate = rate;
  }
  return solve_clocks(kFive, pairs, 0);
}

TEST(ClockGraph, PairsThatShareACameraAreNotThatManyWitnessesOfItsRate) {
  EXPECT_NEAR(with_rate_of_e(1.0022, 0.001).clocks.find("e")->rate, 1, 100e-6);
  EXPECT_NEAR(with_rate_of_e(1.01, 0.001).clocks.find("e")->rate, 1.01, 0.002);
}

TEST(ClockGraph, MorePairsDoNotMakeACameraMoreCertainThanItsOwnErrors) {
  const double std_s = solve_clocks(kFive, all_pairs(0.001), 0).clocks.cameras[1].offset_std_s;
  const double independent_s = 0.001 * std::sqrt(2.0 / 5);
  EXPECT_GT(std_s, 1.15 * independent_s);
  EXPECT_LT(std_s, 0.001);
}

TEST(ClockGraph, WrongFrameRateIsFoundWhereThePairsTellIt) {
  std::vector<PairOffset> pairs;
  const std::vector<std::string> names = {"a", "b", "c", "d"};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = i + 1; j < 4; ++j) {
      const double rate = (j == 1 ? 1 / 1.01 : 1) / (i == 1 ? 1 / 1.01 : 1);
      pairs.push_back(rated(names[i], names[j], 0, rate, 0.002));
    }
  const auto solution = solve_clocks({{"a"}, {"b"}, {"c"}, {"d"}}, pairs, 0);
  EXPECT_NEAR(solution.clocks.find("b")->rate, 1 / 1.01, 1e-4);
  EXPECT_NEAR(solution.clocks.find("c")->rate, 1, 1e-4);
}

TEST(ClockGraph, MoreCertainPairWeighsMore) {
  const std::vector<PairOffset> pairs = {{"a", "b", 0.100, 1, 0.0005, true, "", 9, ""},
                                         {"a", "c", 0.200, 1, 0.0005, true, "", 9, ""},
                                         {"b", "c", 0.104, 1, 0.004, true, "", 9, ""}};
  const auto solution = solve_clocks({{"a"}, {"b"}, {"c"}}, pairs, 0);
  EXPECT_NEAR(solution.clocks.find("b")->offset_s, 0.1, 2e-4);
  EXPECT_NEAR(solution.clocks.find("c")->offset_s, 0.2, 2e-4);
}

TEST(GraphPicture, ShowsWhatEachPairIsAndWhoIsNotTied) {
  auto pairs = all_pairs();
  for (auto& pair : pairs) {
    pair.verdict = "fine & <good>";
    if (pair.b == "e") pair.determined = false, pair.verdict = "undetermined: no motion";
  }
  const std::string svg = graph_picture(kFive, pairs, solve_clocks(kFive, pairs, 0));
  const auto count = [&](const std::string& word) {
    int num = 0;
    for (auto at = svg.find(word); at != std::string::npos; at = svg.find(word, at + 1)) ++num;
    return num;
  };
  EXPECT_EQ(count("<line"), 10);
  EXPECT_EQ(count("stroke-dasharray"), 4) << "e's pairs";
  EXPECT_EQ(count("not tied"), 1);
  EXPECT_EQ(count("fine &amp; &lt;good&gt;"), 6);
}

class KnownClocks : public testing::Test {
 protected:
  KnownClocks() {
    shot_.sections["sync"] = {"shot.toml", "sync", 9, {{"method", {"known", 10}}}};
    for (const auto& [name, start] : {std::pair{"left", 0.25}, std::pair{"right", 0.5}}) {
      ShotCamera camera;
      camera.name = name;
      camera.start_s = start;
      camera.line = 3 * static_cast<int>(shot_.cameras.size()) + 4;
      shot_.cameras.push_back(camera);
    }
  }
  Shot shot_;
};

TEST_F(KnownClocks, AreTheStartsOfTheCameras) {
  const ShotState state(shot_, [](const std::string&) { return std::nullopt; });
  const auto units = AlignJob::split(state, {});
  ASSERT_EQ(units.size(), 1U);
  const auto folder = std::filesystem::path(testing::TempDir()) / ("known_clocks_" + std::to_string(getpid()));
  JobContext::Config config{.unit = units[0].unit,
                            .inputs = {},
                            .sources = {},
                            .out_dir = folder / "out",
                            .scratch_dir = folder,
                            .cores = 1,
                            .on_progress = {}};
  for (const std::string name : {"left", "right"}) {
    std::filesystem::create_directories(folder / name);
    write_frame_table(folder / name / "frames.json", {name, 320, 180, 30, {0, 1 / 30.0, 2 / 30.0}});
    config.inputs["ingest/" + name] = folder / name;
  }
  std::filesystem::create_directories(config.out_dir);
  JobContext context(config);
  AlignJob::run(context, {});
  const Clocks clocks = read_clocks(config.out_dir);
  EXPECT_EQ(clocks.reference, "left");
  EXPECT_DOUBLE_EQ(clocks.find("left")->offset_s, 0.25);
  EXPECT_DOUBLE_EQ(clocks.find("right")->offset_s, 0.5);
  EXPECT_DOUBLE_EQ(clocks.find("right")->rate, 1);
  EXPECT_DOUBLE_EQ(clocks.find("right")->offset_std_s, 0);
  EXPECT_EQ(context.figures().at("warnings").size(), 2U) << "the clips do not overlap, and that is said";
  std::filesystem::remove_all(folder);
}

TEST_F(KnownClocks, MissingStartIsNamedWithItsLine) {
  shot_.cameras[1].start_s.reset();
  const ShotState state(shot_, [](const std::string&) { return std::nullopt; });
  try {
    AlignJob::split(state, {});
    FAIL() << "expected an error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::BadInput);
    EXPECT_NE(std::string(error.what()).find("shot.toml:7: camera 'right'"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace vantage::align
