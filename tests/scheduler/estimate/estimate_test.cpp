#include "scheduler/estimate/estimate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "scheduler/estimate/critical_path.h"
#include "scheduler/estimate/play.h"

namespace vantage {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

DurationStats stats_of(std::vector<double> durations_s) { return duration_stats(durations_s); }
KindKnowledge known(const std::string& kind, std::vector<double> durations_s) {
  return {.kind = kind, .stats = stats_of(std::move(durations_s))};
}

TEST(Play, ListSchedulingOnTwoSlots) {
  // 0 → 2; 1 is long. Slots: 0 (1 s), 1 (5 s); then 2 (1 s) after 0; 3 free (2 s).
  const std::vector<WorkItem> items{{.kind = 0}, {.kind = 0}, {.kind = 1, .needs = {0}}, {.kind = 0}};
  const ItemGraph graph(items);
  const std::vector<double> durations{1, 5, 1, 2};
  EXPECT_DOUBLE_EQ(play(items, graph, durations, {.num_slots = 2, .num_cores = 2}), 5);
  EXPECT_DOUBLE_EQ(play(items, graph, durations, {.num_slots = 1, .num_cores = 2}), 9);
  EXPECT_DOUBLE_EQ(play(items, graph, durations, {.num_slots = 4, .num_cores = 4}), 5);
}

TEST(Play, CoresBoundWhatRunsTogetherAndTooWideItemsGetAllOfThem) {
  const std::vector<WorkItem> items{{.cores = 2}, {.cores = 2}, {.cores = 99}};
  const ItemGraph graph(items);
  const std::vector<double> durations{1, 1, 1};
  EXPECT_DOUBLE_EQ(play(items, graph, durations, {.num_slots = 8, .num_cores = 4}), 2);
  EXPECT_DOUBLE_EQ(play(items, graph, durations, {.num_slots = 8, .num_cores = 2}), 3);
}

TEST(Estimate, OfManyEqualJobsIsTheirNumberBySlots) {
  EstimateInput input{.kinds = {known("depth", std::vector<double>(100, 10.0))}, .items = {}, .capacity = {4, 4}};
  input.items.assign(400, WorkItem{.kind = 0});
  const auto estimate = estimate_rest(input);
  ASSERT_TRUE(estimate);
  EXPECT_NEAR(estimate->middle_s, 1000, 60);
  EXPECT_LE(estimate->low_s, estimate->middle_s);
  EXPECT_LE(estimate->middle_s, estimate->high_s);
}

TEST(Estimate, FewDurationsSeenMakeAWideInterval) {
  const auto width = [](int num_seen) {
    std::vector<double> seen;
    for (int i = 0; i < num_seen; ++i) seen.push_back(i % 2 == 0 ? 8.0 : 12.0);
    EstimateInput input{.kinds = {known("depth", seen)}, .items = {}, .capacity = {2, 2}};
    input.items.assign(200, WorkItem{.kind = 0});
    const auto e = estimate_rest(input);
    return (e->high_s - e->low_s) / e->middle_s;
  };
  EXPECT_GT(width(2), 2 * width(100));
}

TEST(Estimate, StagesThatAreNotPlannedYetCount) {
  EstimateInput input{.kinds = {known("ingest", {1, 1, 1, 1, 1}), known("depth", {10, 10, 10, 10, 10})},
                      .items = {{.kind = 0}},
                      .capacity = {1, 1}};
  const double without = estimate_rest(input)->middle_s;
  input.kinds[1].num_unplanned = 10;
  EXPECT_NEAR(estimate_rest(input)->middle_s - without, 100, 30);
}

TEST(Estimate, WhatIsNotKnownIsSaid) {
  EstimateInput input{.kinds = {known("ingest", {1, 1}), known("depth", {}), known("render", {1})},
                      .items = {{.kind = 0}, {.kind = 1}},
                      .capacity = {1, 1}};
  input.kinds[2].num_unplanned = std::nullopt;
  EXPECT_THAT(estimate_rest(input)->unknown_kinds, ElementsAre("depth", "render"));
  input.items = {{.kind = 1}};
  input.kinds[2].num_unplanned = 0;
  EXPECT_FALSE(estimate_rest(input)) << "nothing that is left has been timed";
  input.capacity = {};
  EXPECT_FALSE(estimate_rest(input)) << "nobody works";
}

TEST(Estimate, RunningJobsHaveOnlyTheirRestLeft) {
  EstimateInput input{
      .kinds = {known("depth", std::vector<double>(50, 100.0))}, .items = {{.kind = 0}}, .capacity = {1, 1}};
  const double whole = estimate_rest(input)->middle_s;
  input.items[0].elapsed_s = 60;
  EXPECT_LT(estimate_rest(input)->middle_s, 0.6 * whole);
}

TEST(Estimate, SameInputGivesTheSameAnswer) {
  EstimateInput input{.kinds = {known("depth", {5, 9, 14})}, .items = {{.kind = 0}, {.kind = 0}}, .capacity = {1, 1}};
  EXPECT_EQ(estimate_rest(input)->high_s, estimate_rest(input)->high_s);
}

/// A made-up shot: cameras → one calibration → frames (two kinds in step), with its own true durations. Some of each
/// early kind have been seen; the truth is played once.
struct World {
  explicit World(std::uint64_t seed) : random(seed) {}
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); }

  /// Whether the true end lies within the interval.
  bool is_caught() {
    EstimateInput input;
    std::vector<DurationLaw> truth;
    for (const std::string kind : {"ingest", "calibrate", "depth", "render"}) {
      truth.push_back({.mean_log = uniform(0, 4), .sd_log = uniform(0.1, 0.6)});
      std::vector<double> seen;
      for (int i = static_cast<int>(uniform(3, 30)); i > 0; --i) seen.push_back(truth.back().draw_s(random));
      input.kinds.push_back(known(kind, seen));
    }
    const int num_frames = static_cast<int>(uniform(20, 120));
    input.items = {{.kind = 0}, {.kind = 0}, {.kind = 1, .needs = {0, 1}}};
    for (int i = 0; i < num_frames; ++i) {
      input.items.push_back({.kind = 2, .needs = {2}});
      input.items.push_back({.kind = 3, .needs = {static_cast<int>(input.items.size()) - 1}});
    }
    input.capacity.num_slots = input.capacity.num_cores = static_cast<int>(uniform(2, 12));
    std::vector<double> true_s;
    for (const WorkItem& item : input.items)
      true_s.push_back(truth[static_cast<std::size_t>(item.kind)].draw_s(random));
    const double end_s = play(input.items, ItemGraph(input.items), true_s, input.capacity);
    const auto estimate = estimate_rest(input);
    return estimate->low_s <= end_s && end_s <= estimate->high_s;
  }
  std::mt19937_64 random;
};

TEST(Estimate, EightOfTenTrueEndsLieWithinTheInterval) {
  constexpr int kNumWorlds = 300;
  int num_caught = 0;
  for (int i = 0; i < kNumWorlds; ++i) num_caught += World(static_cast<std::uint64_t>(i)).is_caught() ? 1 : 0;
  const double caught = static_cast<double>(num_caught) / kNumWorlds;
  RecordProperty("caught", std::to_string(caught));
  EXPECT_GE(caught, 0.72);
  EXPECT_LE(caught, 0.92) << "an interval that is never missed says nothing";
}

TEST(CriticalPath, IsTheLongestChain) {
  const std::vector<KindKnowledge> kinds{known("short", {1, 1, 1}), known("long", {10, 10, 10})};
  // 0 → 2 → 3, 1 → 3 with 1 long: the chain over 1.
  const std::vector<WorkItem> items{{.kind = 0}, {.kind = 1}, {.kind = 0, .needs = {0}}, {.kind = 0, .needs = {2, 1}}};
  const CriticalPath path = critical_path(items, kinds);
  EXPECT_THAT(path.items, ElementsAre(1, 3));
  EXPECT_NEAR(path.length_s, 11, 3);
  EXPECT_THAT(critical_path({}, kinds).items, IsEmpty());
}

TEST(CriticalPath, CountsWhatARunningJobHasDone) {
  const std::vector<KindKnowledge> kinds{known("long", {10, 10, 10})};
  const std::vector<WorkItem> items{{.kind = 0, .elapsed_s = 9}, {.kind = 0}};
  EXPECT_THAT(critical_path(items, kinds).items, ElementsAre(1));
}

}  // namespace
}  // namespace vantage
