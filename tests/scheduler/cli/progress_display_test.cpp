#include "scheduler/cli/progress_display.h"

#include <gtest/gtest.h>

#include "scheduler/cli/command_table.h"
#include "scheduler/cli/run_summary.h"

namespace vantage {
namespace {

ShotProgress::Kind kind(int done, int running, int ready, std::int64_t wall_ms) {
  ShotProgress::Kind k;
  k.kind = "depth";
  k.num_by_state = {{"done", done}, {"running", running}, {"ready", ready}};
  k.num_jobs = done + running + ready;
  k.num_finished = done;
  k.wall_ms = wall_ms;
  return k;
}

TEST(BarText, ShowsFinishedRunningAndWaiting) {
  EXPECT_EQ(bar_text(kind(5, 2, 3, 0), 10), "#####>>---");
  EXPECT_EQ(bar_text(kind(0, 1, 999, 0), 10), ">---------");
  EXPECT_EQ(bar_text(kind(10, 0, 0, 0), 10), "##########");
  EXPECT_EQ(bar_text(kind(0, 0, 0, 0), 4), "    ");
}

TEST(RemainingTime, IsMeanCostTimesWorkLeftOverWorkers) {
  ShotProgress progress;
  progress.kinds = {kind(10, 0, 20, 30'000)};
  EXPECT_NEAR(*remaining_s(progress, 2), 30, 1e-9);
}

TEST(RemainingTime, IsUnknownBeforeAStageHasFinishedAJob) {
  ShotProgress progress;
  progress.kinds = {kind(10, 0, 0, 30'000), kind(0, 1, 5, 0)};
  EXPECT_FALSE(remaining_s(progress, 2));
}

TEST(ExitCode, TellsBadInputFromOtherFailures) {
  RunSummary summary{.shot = "a", .state = "done", .error = "", .failures = {}, .warnings = {}, .results = {}};
  EXPECT_EQ(exit_code(summary), kExitOk);
  summary.state = "failed";
  summary.failures = {{"depth/a", "failed", "crash", "", ""}};
  EXPECT_EQ(exit_code(summary), kExitFailed);
  summary.failures.push_back({"ingest/a", "failed", "bad_input", "", ""});
  EXPECT_EQ(exit_code(summary), kExitMisuse);
}

}  // namespace
}  // namespace vantage
