#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scheduler/dispatch/command.h"
#include "schema/base/error.h"
#include "tests/support/fake_farm.h"

namespace vantage {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::UnorderedElementsAre;
using Verb = Command::Verb;

class CommandsTest : public testing::Test {
 protected:
  void SetUp() override {
    farm.num_edges = 4;
    farm.submit();
  }
  /// Runs what there is until the worker holds a job of this kind.
  void run_until(const std::string& kind) {
    for (int round = 0; round < 50; ++round) {
      farm.clock.now_ms += 100;
      farm.sync(worker);
      for (const auto& [ref, assignment] : worker.held())
        if (read_job_file(assignment.spec_path).kind == kind) return;
      if (!worker.held().empty()) worker.finish(worker.held().begin()->first);
    }
    FAIL() << "never came to " << kind;
  }
  void fail_held(ErrorKind kind) {
    while (!worker.held().empty()) worker.fail(worker.held().begin()->first, Outcome::Failed, kind, "it went wrong");
    farm.sync(worker);
  }
  JobId id(const std::string& name) { return farm.job(name).id; }
  std::string shot_state() { return farm.store->shot(farm.shot)->state; }
  std::string error_of(const Command& command) {
    try {
      farm.command(command);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::BadInput);
      return e.what();
    }
    return "";
  }
  /// All of the database that a command may change.
  std::string everything() {
    std::string all;
    for (const char* sql :
         {"SELECT id || state || reason || priority || num_unmet || coalesce(content, '') FROM job",
          "SELECT id || state || priority FROM shot", "SELECT id || kind || text FROM event",
          "SELECT shot_id || kind FROM stage_setting", "SELECT kind || key FROM suspect",
          "SELECT job_id || number || state || outcome FROM attempt", "SELECT id || state FROM worker"})
      for (Query q = farm.store->db().query(sql); q.step();) all += q.text(0) + "\n";
    return all;
  }

  FakeFarm farm;
  FakeWorker worker{"w", 2};
};

TEST_F(CommandsTest, PausedStageStartsNothingEvenOfJobsPlannedLater) {
  farm.command({.verb = Verb::Pause, .shot = farm.shot, .stage = "correspond"});  // none of it is planned yet
  farm.run_to_end(worker);
  EXPECT_EQ(farm.state("navspace"), JobState::Done);
  EXPECT_EQ(farm.state("correspond/0"), JobState::Paused);
  EXPECT_THAT(farm.job("correspond/0").reason, HasSubstr("stage is paused"));
  EXPECT_EQ(shot_state(), "running");
  const CommandResult result = farm.command({.verb = Verb::Resume, .shot = farm.shot, .stage = "correspond"});
  EXPECT_EQ(result.num_changed, 4);
  farm.run_to_end(worker);
  EXPECT_EQ(shot_state(), "done");
}

TEST_F(CommandsTest, OneJobOfAPausedStageCannotGoOnAlone) {
  farm.command({.verb = Verb::Pause, .shot = farm.shot, .stage = "ingest"});
  EXPECT_THAT(error_of({.verb = Verb::Resume, .job = id("ingest/a")}), HasSubstr("whole stage ingest is paused"));
}

TEST_F(CommandsTest, NewSubmissionForgetsWhatWasSaidOfStages) {
  farm.command({.verb = Verb::Pause, .shot = farm.shot, .stage = "correspond"});
  farm.command({.verb = Verb::Priority, .shot = farm.shot, .priority = 9, .stage = "correspond"});
  farm.submit();
  farm.run_to_end(worker);
  EXPECT_EQ(shot_state(), "done");
  EXPECT_EQ(farm.job("correspond/0").priority, 0);
}

TEST_F(CommandsTest, PriorityOfAStageHoldsForJobsPlannedLater) {
  farm.command({.verb = Verb::Priority, .shot = farm.shot, .priority = 7, .stage = "correspond"});
  run_until("correspond");
  EXPECT_EQ(farm.job("correspond/0").priority, 7);
  EXPECT_EQ(farm.job("ingest/a").priority, 0);
}

TEST_F(CommandsTest, PriorityOfAJobIsLive) {
  run_until("correspond");  // two of four are held
  std::vector<std::string> ready;
  for (int i = 0; i < 4; ++i)
    if (const std::string name = fmt::format("correspond/{}", i); farm.state(name) == JobState::Ready)
      ready.push_back(name);
  ASSERT_THAT(ready, SizeIs(testing::Ge(2U)));
  farm.command({.verb = Verb::Priority, .job = id(ready.back()), .priority = 5});
  worker.finish(worker.held().begin()->first);
  farm.sync(worker);
  EXPECT_TRUE(is_active(farm.state(ready.back())));
}

TEST_F(CommandsTest, CancelingAStageAbortsWhatNeedsItAndStopsItsWorkers) {
  run_until("correspond");
  const CommandResult result = farm.command({.verb = Verb::Cancel, .shot = farm.shot, .stage = "correspond"});
  EXPECT_EQ(result.num_changed, 5);
  EXPECT_THAT(result.affected, Contains("encode"));
  EXPECT_EQ(farm.state("correspond/3"), JobState::Canceled);
  EXPECT_EQ(farm.state("encode"), JobState::Aborted);
  farm.sync(worker);
  EXPECT_THAT(worker.held(), IsEmpty());
  EXPECT_EQ(shot_state(), "failed");
}

TEST_F(CommandsTest, RetryPreviewCountsFailedJobsAndDependents) {
  run_until("correspond");
  fail_held(ErrorKind::BadInput);
  fail_held(ErrorKind::BadInput);
  ASSERT_EQ(farm.state("encode"), JobState::Aborted);
  const CommandResult preview = farm.command({.verb = Verb::Retry, .shot = farm.shot, .dry_run = true});
  EXPECT_THAT(preview.text, HasSubstr("would run again: 4 failed + 1 dependents"));
  EXPECT_THAT(preview.affected,
              UnorderedElementsAre("correspond/0", "correspond/1", "correspond/2", "correspond/3", "encode"));
  EXPECT_EQ(farm.state("correspond/0"), JobState::Failed);
  EXPECT_EQ(farm.command({.verb = Verb::Retry, .shot = farm.shot}).num_changed, preview.num_changed);
  farm.run_to_end(worker);
  EXPECT_EQ(shot_state(), "done");
}

TEST_F(CommandsTest, RetryOfAStageLeavesOtherFailures) {
  run_until("ingest");
  fail_held(ErrorKind::BadInput);
  const CommandResult result = farm.command({.verb = Verb::Retry, .shot = farm.shot, .dry_run = true});
  EXPECT_EQ(result.num_changed, 4);
  EXPECT_EQ(farm.command({.verb = Verb::Retry, .job = id("ingest/a"), .dry_run = true}).num_changed, 1)
      << "calibrate needs ingest/b, too";
  EXPECT_EQ(farm.command({.verb = Verb::Retry, .shot = farm.shot, .stage = "ingest", .dry_run = true}).num_changed, 4);
}

TEST_F(CommandsTest, DryRunChangesNothing) {
  run_until("correspond");
  fail_held(ErrorKind::BadInput);
  const std::string before = everything();
  for (const Verb verb : {Verb::Pause, Verb::Cancel, Verb::Retry, Verb::Priority})
    for (const std::string stage : {"", "correspond"}) {
      farm.store->begin();
      farm.dispatcher->on_command({.verb = verb, .shot = farm.shot, .priority = 3, .stage = stage, .dry_run = true});
      farm.store->commit();
    }
  farm.store->begin();
  farm.dispatcher->on_command({.verb = Verb::Rerun, .shot = farm.shot, .stage = "ingest", .dry_run = true});
  farm.dispatcher->on_command({.verb = Verb::Drain, .worker = "w", .dry_run = true});
  farm.store->commit();
  EXPECT_EQ(everything(), before);
}

TEST_F(CommandsTest, RerunOfAnEqualResultStopsEarly) {
  farm.run_to_end(worker);
  ASSERT_EQ(shot_state(), "done");
  const std::string content = farm.job("navspace").content;
  const CommandResult preview = farm.command({.verb = Verb::Rerun, .job = id("navspace"), .dry_run = true});
  EXPECT_EQ(preview.num_changed, 6);
  EXPECT_THAT(preview.text, HasSubstr("1 job, then those of 5 dependents whose inputs come out different"));
  farm.command({.verb = Verb::Rerun, .job = id("navspace"), .who = "ana"});
  EXPECT_EQ(shot_state(), "running");
  EXPECT_EQ(farm.state("encode"), JobState::Blocked);
  EXPECT_THAT(farm.run_to_end(worker), ElementsAre("navspace"));
  EXPECT_EQ(shot_state(), "done");
  EXPECT_EQ(farm.job("navspace").content, content);
  EXPECT_EQ(farm.state("encode"), JobState::Skipped);
  EXPECT_TRUE(std::filesystem::is_empty(farm.shot_folder() / ".vantage/aside"))
      << "the copy of an equal result is gone";
}

TEST_F(CommandsTest, RerunThatComesOutDifferentRunsWhatNeedsItAndKeepsTheOldResult) {
  farm.run_to_end(worker);
  const std::string old = farm.job("navspace").content;
  farm.command({.verb = Verb::Rerun, .shot = farm.shot, .stage = "navspace"});
  farm.sync(worker);
  ASSERT_THAT(worker.held(), SizeIs(1));
  worker.finish(worker.held().begin()->first, "another day");
  farm.sync(worker);
  EXPECT_NE(farm.job("navspace").content, old);
  EXPECT_THAT(farm.run_to_end(worker), SizeIs(5));
  EXPECT_EQ(shot_state(), "done");
  const auto aside = farm.store->db().text_or("", "SELECT text FROM event WHERE kind = 'warning'");
  EXPECT_THAT(aside, HasSubstr("made again, it differs"));
  EXPECT_FALSE(std::filesystem::is_empty(farm.shot_folder() / ".vantage/aside"));
}

TEST_F(CommandsTest, RerunOutlivesACrashOfTheScheduler) {
  farm.run_to_end(worker);
  farm.command({.verb = Verb::Rerun, .job = id("navspace")});
  farm.kill();
  farm.start();
  worker.restart();
  EXPECT_THAT(farm.run_to_end(worker), ElementsAre("navspace"));
  EXPECT_EQ(shot_state(), "done");
}

TEST_F(CommandsTest, RerunThatIsLostAfterItCommittedIsSalvagedAndCompared) {
  farm.run_to_end(worker);
  farm.command({.verb = Verb::Rerun, .job = id("navspace")});
  farm.sync(worker);
  ASSERT_THAT(worker.held(), SizeIs(1));
  worker.finish(worker.held().begin()->first);  // never reported
  farm.clock.now_ms += FakeFarm::kLeaseMs;
  farm.turn();  // found
  farm.turn();  // planned again
  EXPECT_EQ(shot_state(), "done");
  EXPECT_EQ(farm.store->db().integer_or(-1, "SELECT count(*) FROM suspect"), 0);
}

TEST_F(CommandsTest, RerunOfWhatIsNotFinishedSaysSo) {
  EXPECT_THAT(error_of({.verb = Verb::Rerun, .job = id("navspace")}),
              HasSubstr("blocked; only finished results can be made again"));
  EXPECT_THAT(error_of({.verb = Verb::Rerun, .shot = farm.shot}), HasSubstr("name the job or the stage"));
}

TEST_F(CommandsTest, UnknownStageIsNamedWithASuggestion) {
  EXPECT_THAT(error_of({.verb = Verb::Pause, .shot = farm.shot, .stage = "corespond"}), HasSubstr("'correspond'"));
}

TEST_F(CommandsTest, EveryEventOfACommandCarriesWhoAsked) {
  farm.command({.verb = Verb::Cancel, .job = id("ingest/a"), .who = "ana@studio"});
  const auto count = [&](const std::string& where) {
    return farm.store->db().integer_or(-1, "SELECT count(*) FROM event WHERE " + where);
  };
  EXPECT_EQ(count("kind = 'command' AND who = 'ana@studio'"), 1);
  EXPECT_GE(count("kind = 'state' AND who = 'ana@studio' AND text LIKE 'canceled%'"), 1);
  const auto before = count("who = 'ana@studio'");
  farm.sync(worker);
  EXPECT_EQ(count("who = 'ana@studio'"), before) << "what the farm does by itself is nobody's";
}

}  // namespace
}  // namespace vantage
