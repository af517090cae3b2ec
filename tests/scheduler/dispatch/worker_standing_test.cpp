#include "scheduler/dispatch/worker_standing.h"

#include <gtest/gtest.h>

#include "schema/base/error.h"

namespace vantage {
namespace {

using Effect = WorkerStanding::Effect;

TEST(WorkerStanding, ThreeDifferentJobsInARowSetAsideOneJobThriceDoesNot) {
  WorkerStanding standing;
  for (int i = 0; i < 5; ++i) EXPECT_EQ(standing.note_failure({1}, "depth", 0), Effect::None);
  EXPECT_EQ(standing.note_failure({2}, "render", 0), Effect::None);
  EXPECT_EQ(standing.note_failure({3}, "ingest", 0), Effect::SetAside);
  EXPECT_EQ(standing.note_failure({4}, "ingest", 0), Effect::None) << "is set aside already";
}

TEST(WorkerStanding, AGoodJobBetweenBreaksTheRowButNotTheKind) {
  WorkerStanding standing;
  standing.note_failure({1}, "depth", 0);
  standing.note_failure({2}, "depth", 0);
  EXPECT_TRUE(standing.note_success({9}, "render"));
  EXPECT_EQ(standing.note_failure({3}, "depth", 0), Effect::KindStopped);
  EXPECT_TRUE(standing.is_stopped("depth", 0));
  EXPECT_FALSE(standing.is_stopped("render", 0));
  EXPECT_TRUE(standing.note_success({8}, "depth"));
  EXPECT_FALSE(standing.is_stopped("depth", 0));
  EXPECT_FALSE(standing.note_success({7}, "render")) << "nothing left to forgive: nothing to write";
}

TEST(WorkerStanding, FailedJobIsRememberedForFiveHours) {
  WorkerStanding standing;
  standing.note_failure({1}, "depth", 1000);
  EXPECT_TRUE(standing.has_failed({1}, 1000 + WorkerStanding::kForgiveMs - 1));
  EXPECT_FALSE(standing.has_failed({1}, 1000 + WorkerStanding::kForgiveMs));
  EXPECT_FALSE(standing.has_failed({2}, 1000));
  standing.forgive();
  EXPECT_FALSE(standing.has_failed({1}, 1000));
}

TEST(WorkerStanding, OldFailuresDoNotCountWithNewOnes) {
  WorkerStanding standing;
  standing.note_failure({1}, "depth", 0);
  standing.note_failure({2}, "depth", 0);
  EXPECT_EQ(standing.note_failure({3}, "depth", WorkerStanding::kForgiveMs), Effect::None);
}

TEST(WorkerStanding, BadInputAndBugsAreNotTheWorkersFault) {
  const auto failed = [](ErrorKind kind) {
    DoneAttempt d;
    d.outcome = Outcome::Failed;
    d.error_kind = std::string(to_string(kind));
    return d;
  };
  EXPECT_FALSE(may_blame_worker(failed(ErrorKind::BadInput)));
  EXPECT_FALSE(may_blame_worker(failed(ErrorKind::Bug)));
  EXPECT_TRUE(may_blame_worker(failed(ErrorKind::Transient)));
  EXPECT_TRUE(may_blame_worker(failed(ErrorKind::Resource)));
  DoneAttempt crashed;
  crashed.outcome = Outcome::Crashed;
  EXPECT_TRUE(may_blame_worker(crashed));
  DoneAttempt canceled;
  canceled.outcome = Outcome::Canceled;
  EXPECT_FALSE(may_blame_worker(canceled));
}

}  // namespace
}  // namespace vantage
