#include "scheduler/plan/planner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>

#include "schema/base/error.h"
#include "tests/support/fake_farm.h"

namespace vantage {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::UnorderedElementsAre;

class PlannerTest : public testing::Test {
 protected:
  void finish_first_run() {
    farm.submit();
    ASSERT_THAT(farm.run_to_end(worker), SizeIs(8));
    ASSERT_EQ(shot_state(), "done");
  }
  std::string shot_state() { return farm.store->shot(farm.shot)->state; }
  void throws_bad_input(const std::function<void()>& fn, const std::string& message) {
    try {
      fn();
      FAIL() << "did not refuse";
    } catch (const Error& e) {
      EXPECT_THAT(e.what(), HasSubstr(message));
    }
  }

  FakeFarm farm;
  FakeWorker worker{"w", 2};
};

TEST_F(PlannerTest, PlanGrowsAsResultsArrive) {
  EXPECT_EQ(farm.submit().num_jobs, 4);  // ingest × 2, calibrate, navspace
  EXPECT_EQ(farm.state("ingest/a"), JobState::Ready);
  EXPECT_EQ(farm.state("calibrate"), JobState::Blocked);
  EXPECT_EQ(farm.job("calibrate").num_unmet, 2);
  const auto ran = farm.run_to_end(worker);
  EXPECT_EQ(shot_state(), "done");
  EXPECT_THAT(ran, UnorderedElementsAre("ingest/a", "ingest/b", "calibrate", "navspace", "correspond/0", "correspond/1",
                                        "correspond/2", "encode"));
  EXPECT_EQ(farm.job("encode").reason, "first run");
}

TEST_F(PlannerTest, UntilPlansThatStageAndWhatItNeeds) {
  farm.submit("calibrate");
  EXPECT_THAT(farm.run_to_end(worker), UnorderedElementsAre("ingest/a", "ingest/b", "calibrate"));
  EXPECT_EQ(shot_state(), "done");
  farm.submit("correspond");
  EXPECT_THAT(farm.run_to_end(worker),
              UnorderedElementsAre("navspace", "correspond/0", "correspond/1", "correspond/2"));
}

TEST_F(PlannerTest, SecondRunRunsNothing) {
  finish_first_run();
  const auto again = farm.submit();
  EXPECT_EQ(again.num_jobs, 8);
  EXPECT_EQ(again.num_up_to_date, 8);
  EXPECT_THAT(farm.run_to_end(worker), IsEmpty());
  EXPECT_EQ(shot_state(), "done");
}

TEST_F(PlannerTest, TouchedFootageRunsNothing) {
  finish_first_run();
  std::filesystem::last_write_time(farm.shot_folder() / "a.mp4",
                                   std::filesystem::file_time_type::clock::now() + std::chrono::hours(1));
  farm.submit();
  EXPECT_THAT(farm.run_to_end(worker), IsEmpty());
}

TEST_F(PlannerTest, ChangedFootageRunsAllThatItReaches) {
  finish_first_run();
  write_file_atomically(farm.shot_folder() / "a.mp4", "other footage");
  farm.submit();
  EXPECT_EQ(farm.job("ingest/a").reason, "source footage changed");
  EXPECT_THAT(farm.run_to_end(worker), SizeIs(7));  // all but ingest/b
  EXPECT_EQ(farm.num_attempts("ingest/b"), 1);
  EXPECT_EQ(shot_state(), "done");
}

TEST_F(PlannerTest, EditRunsOnlyWhatItReachesAndSaysWhy) {
  finish_first_run();
  farm.gain = 2;
  farm.submit();
  EXPECT_EQ(farm.job("encode").reason, "params.gain 1.0 → 2.0");
  EXPECT_THAT(farm.run_to_end(worker), ElementsAre("encode"));
  EXPECT_EQ(shot_state(), "done");
}

TEST_F(PlannerTest, EqualResultStopsTheEditFromReachingFurther) {
  finish_first_run();
  farm.sigma = 1.4;  // calibrate's artifact has the same bytes
  farm.submit();
  EXPECT_EQ(farm.job("calibrate").reason, "params.sigma 1.2 → 1.4");
  EXPECT_THAT(farm.run_to_end(worker), ElementsAre("calibrate"));
  EXPECT_EQ(shot_state(), "done");
}

TEST_F(PlannerTest, OtherResultReachesEverythingBehindIt) {
  finish_first_run();
  farm.sigma = 2.5;
  farm.submit();
  EXPECT_THAT(farm.run_to_end(worker), SizeIs(6));
  EXPECT_EQ(farm.job("navspace").reason, "input calibrate changed");
}

TEST_F(PlannerTest, EditTakenBackFindsTheOldResults) {
  finish_first_run();
  farm.sigma = 2.5;
  farm.submit();
  farm.run_to_end(worker);
  farm.sigma = 1.2;
  farm.submit();
  EXPECT_THAT(farm.run_to_end(worker), IsEmpty());
  EXPECT_EQ(shot_state(), "done");
}

TEST_F(PlannerTest, MissingOutputIsMadeAgainAndNothingElse) {
  finish_first_run();
  const JobRow job = farm.job("navspace");
  std::filesystem::remove_all(artifact_folder(farm.shot_folder() / ".vantage/store", job.kind, job.key));
  farm.submit();
  EXPECT_EQ(farm.job("navspace").reason, "output missing");
  EXPECT_THAT(farm.run_to_end(worker), ElementsAre("navspace"));
  EXPECT_EQ(shot_state(), "done");
}

TEST_F(PlannerTest, JobsThatAreNotWantedAnyMoreAreAborted) {
  farm.submit();
  while (!farm.store->find_job(farm.shot, "encode")) {
    farm.sync(worker);
    if (!worker.held().empty()) worker.finish(worker.held().begin()->first);
  }
  farm.num_edges = 2;
  farm.submit();
  EXPECT_EQ(farm.state("correspond/2"), JobState::Aborted);
  farm.run_to_end(worker);
  EXPECT_EQ(shot_state(), "done");
  EXPECT_EQ(farm.num_attempts("correspond/2"),
            worker.num_runs.contains("correspond/2") ? 1 : farm.num_attempts("correspond/2"));
  EXPECT_EQ(worker.num_runs.count("correspond/2"), 0U);
}

TEST_F(PlannerTest, FailureAbortsWhatNeedsItAndNothingElse) {
  farm.submit();
  for (;;) {
    farm.sync(worker);
    if (worker.held().empty()) break;
    const auto [ref, assignment] = *worker.held().begin();
    if (farm.store->job({ref.job_id})->name == "correspond/1")
      worker.fail(ref, Outcome::Failed, ErrorKind::BadInput, "no texture");
    else
      worker.finish(ref);
  }
  EXPECT_EQ(farm.state("correspond/1"), JobState::Failed);
  EXPECT_EQ(farm.state("correspond/0"), JobState::Done);
  EXPECT_EQ(farm.state("correspond/2"), JobState::Done);
  EXPECT_EQ(farm.state("encode"), JobState::Aborted);
  EXPECT_EQ(farm.job("encode").reason, "needs correspond/1, which is failed");
  EXPECT_EQ(shot_state(), "failed");

  farm.command({.verb = Command::Verb::Retry, .shot = farm.shot});
  EXPECT_THAT(farm.run_to_end(worker), ElementsAre("correspond/1", "encode"));
  EXPECT_EQ(shot_state(), "done");
}

TEST_F(PlannerTest, RetryOfAnAbortedJobRetriesWhatItNeeds) {
  farm.submit("calibrate");
  farm.sync(worker);
  worker.finish(worker.held().begin()->first);
  worker.fail(worker.held().begin()->first, Outcome::Failed, ErrorKind::Bug, "oops");
  farm.sync(worker);
  ASSERT_EQ(shot_state(), "failed");
  EXPECT_EQ(farm.command({.verb = Command::Verb::Retry, .job = farm.job("calibrate").id}).num_changed, 2);
  farm.run_to_end(worker);
  EXPECT_EQ(shot_state(), "done");
}

TEST_F(PlannerTest, RefusesABadShotAndLeavesNothingBehind) {
  throws_bad_input([&] { farm.submit("calibrat"); }, "did you mean 'calibrate'");
  farm.kinds[3].split = [](const ShotState&) -> std::vector<WorkUnit> {
    throw Error(ErrorKind::BadInput, "edges: bad");
  };
  throws_bad_input([&] { farm.submit(); }, "edges: bad");
  EXPECT_EQ(farm.store->db().integer_or(-1, "SELECT count(*) FROM job"), 0);
  EXPECT_EQ(farm.store->db().integer_or(-1, "SELECT count(*) FROM shot"), 0);
}

TEST_F(PlannerTest, SplitThatFailsLaterFailsTheShotAfterTheRestIsDone) {
  farm.kinds[4].split = [](const ShotState& s) -> std::vector<WorkUnit> {
    if (s.artifact("navspace")) throw Error(ErrorKind::BadInput, "render: key frame outside");
    return {};
  };
  farm.submit();
  farm.run_to_end(worker);
  EXPECT_EQ(shot_state(), "failed");
  EXPECT_EQ(farm.store->shot(farm.shot)->error, "render: key frame outside");
  EXPECT_EQ(farm.state("correspond/2"), JobState::Done);
}

TEST_F(PlannerTest, MissingFootageFailsItsJobWithOneLine) {
  std::filesystem::remove(farm.shot_folder() / "a.mp4");
  farm.submit();
  EXPECT_EQ(farm.state("ingest/a"), JobState::Failed);
  EXPECT_EQ(farm.state("calibrate"), JobState::Aborted);
  farm.run_to_end(worker);
  EXPECT_EQ(shot_state(), "failed");
}

TEST_F(PlannerTest, LargeFootageIsReadAsideWhileItsJobWaitsAndSaysSo) {
  write_file_atomically(farm.shot_folder() / "a.mp4", std::string(9 << 20, 'a'));
  std::promise<void> read;
  SourceHasher hasher([&] { read.set_value(); });
  farm.planner->read_footage_with(hasher);
  farm.submit();
  EXPECT_EQ(farm.state("ingest/a"), JobState::Blocked);
  EXPECT_THAT(farm.job("ingest/a").reason, HasSubstr("reading footage a.mp4"));
  EXPECT_EQ(farm.state("ingest/b"), JobState::Ready) << "small footage does not wait";
  ASSERT_EQ(read.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
  farm.turn([&] { farm.planner->go_on_with_footage(); });
  EXPECT_EQ(farm.state("ingest/a"), JobState::Ready);
  EXPECT_THAT(farm.run_to_end(worker), SizeIs(8));
}

TEST_F(PlannerTest, NeedThatNobodyPlansAndCyclesAreOurMistakes) {
  const auto plan_with_need = [&](const std::string& need) {
    farm.kinds[1].split = [need](const ShotState&) {
      WorkUnit u;
      u.name = "calibrate";
      u.needs = {need};
      return std::vector<WorkUnit>{u};
    };
  };
  plan_with_need("ingest/zebra");
  throws_bad_input([&] { farm.submit(); }, "calibrate: needs ingest/zebra, which nobody plans");
  plan_with_need("navspace");
  throws_bad_input([&] { farm.submit(); }, "needs itself");
}

TEST_F(PlannerTest, CancelStopsTheShot) {
  farm.submit();
  farm.sync(worker);
  ASSERT_THAT(worker.held(), SizeIs(2));
  farm.command({.verb = Command::Verb::Cancel, .shot = farm.shot});
  EXPECT_EQ(shot_state(), "failed");
  EXPECT_EQ(farm.state("ingest/a"), JobState::Canceled);
  farm.sync(worker);
  EXPECT_THAT(worker.held(), IsEmpty());
}

TEST_F(PlannerTest, PausedJobWaitsUntilResumed) {
  farm.submit("calibrate");
  farm.command({.verb = Command::Verb::Pause, .job = farm.job("calibrate").id});
  farm.run_to_end(worker, 20);
  EXPECT_EQ(farm.state("calibrate"), JobState::Paused);
  farm.command({.verb = Command::Verb::Resume, .job = farm.job("calibrate").id});
  EXPECT_THAT(farm.run_to_end(worker), ElementsAre("calibrate"));
  EXPECT_EQ(shot_state(), "done");
}

}  // namespace
}  // namespace vantage
