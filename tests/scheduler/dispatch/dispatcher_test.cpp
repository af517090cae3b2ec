#include "scheduler/dispatch/dispatcher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scheduler/dispatch/spec_file.h"
#include "schema/base/error.h"
#include "tests/support/fake_farm.h"

namespace vantage {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class DispatcherTest : public testing::Test {
 protected:
  /// The shot is submitted and the worker holds both ingest jobs.
  void SetUp() override {
    farm.submit();
    farm.sync(worker);
    ASSERT_THAT(worker.held(), SizeIs(2));
    farm.sync(worker);
    ASSERT_EQ(farm.state("ingest/a"), JobState::Running);
  }
  AttemptRef attempt_of(const FakeWorker& w, const std::string& job) const {
    for (const auto& [ref, assignment] : w.held())
      if (read_job_file(assignment.spec_path).job == job) return ref;
    return {};
  }
  std::string outcome(const AttemptRef& ref) { return farm.store->attempt(ref)->outcome; }
  std::string shot_state() { return farm.store->shot(farm.shot)->state; }
  void lease_runs_out() {
    farm.clock.now_ms += FakeFarm::kLeaseMs;
    farm.turn();
  }

  FakeFarm farm;
  FakeWorker worker{"w", 2}, other{"x", 2};
};

TEST_F(DispatcherTest, AssignmentNamesASpecThatIsThereWithThatHash) {
  const Assignment& a = worker.held().begin()->second;
  EXPECT_EQ(hash_file(a.spec_path), a.spec_hash);
  const JobFile job = read_job_file(a.spec_path);
  EXPECT_EQ(job_key(job), job.key);
}

TEST_F(DispatcherTest, LeaseExpiryPutsJobBackInQueueAndAnotherWorkerGetsIt) {
  lease_runs_out();
  EXPECT_EQ(farm.state("ingest/a"), JobState::Ready);
  EXPECT_EQ(farm.store->worker_state("w"), "lost");
  farm.sync(other);
  EXPECT_THAT(other.held(), SizeIs(2));
  EXPECT_EQ(farm.num_attempts("ingest/a"), 2);
  EXPECT_EQ(farm.job("ingest/a").num_failures, 0) << "a lost worker is not the job's fault";
}

TEST_F(DispatcherTest, ReportsKeepTheLease) {
  for (int i = 0; i < 10; ++i) {
    farm.clock.now_ms += FakeFarm::kLeaseMs - 1;
    farm.sync(worker);
  }
  EXPECT_EQ(farm.state("ingest/a"), JobState::Running);
  EXPECT_EQ(farm.num_attempts("ingest/a"), 1);
}

TEST_F(DispatcherTest, ResultCommittedByALostWorkerIsSalvagedWithoutASecondRun) {
  const AttemptRef ref = attempt_of(worker, "ingest/a");
  worker.finish(ref);  // never reported
  lease_runs_out();
  EXPECT_EQ(farm.state("ingest/a"), JobState::Done);
  EXPECT_EQ(farm.num_attempts("ingest/a"), 1);
}

TEST_F(DispatcherTest, LateResultOfASupersededAttemptIsTakenAndTheNewOneStopped) {
  const AttemptRef ref = attempt_of(worker, "ingest/a");
  lease_runs_out();
  farm.sync(other);
  const AttemptRef second = attempt_of(other, "ingest/a");
  ASSERT_EQ(second.number, 2);
  worker.finish(ref);
  farm.sync(worker);
  EXPECT_EQ(farm.state("ingest/a"), JobState::Done);
  EXPECT_EQ(outcome(ref), "done");
  EXPECT_EQ(outcome(second), "canceled");
  farm.sync(other);
  EXPECT_FALSE(other.held().contains(second));
}

TEST_F(DispatcherTest, WorkerThatComesBackKeepsItsJobWhenNobodyElseHasIt) {
  lease_runs_out();
  ASSERT_EQ(farm.state("ingest/a"), JobState::Ready);
  farm.sync(worker);
  EXPECT_EQ(farm.state("ingest/a"), JobState::Running);
  EXPECT_EQ(farm.num_attempts("ingest/a"), 1);
}

TEST_F(DispatcherTest, DuplicateReportIsHarmlessAndAckedAgain) {
  const AttemptRef ref = attempt_of(worker, "ingest/a");
  worker.finish(ref);
  const WorkerReport first = worker.report(), second = worker.report();
  farm.report(first);
  const auto num_events = farm.store->db().integer_or(0, "SELECT count(*) FROM event WHERE job_id = ?", ref.job_id);
  farm.report(first);
  farm.report(second);
  EXPECT_EQ(farm.store->db().integer_or(0, "SELECT count(*) FROM event WHERE job_id = ?", ref.job_id), num_events);
  EXPECT_THAT(farm.bus.sent["w"].back().acked, testing::Contains(ref));
  worker.take(farm.bus.sent["w"].back());
  EXPECT_THAT(worker.report().done_unacked, IsEmpty());
}

TEST_F(DispatcherTest, ReportOfBeforeTheStartIsAnsweredAndChangesNothing) {
  const AttemptRef a = attempt_of(worker, "ingest/a");
  worker.finish(a);
  farm.kill();
  farm.start();
  const auto events = [&] { return farm.store->db().integer_or(0, "SELECT count(*) FROM event"); };
  const auto num_events = events();
  farm.report(worker.report());  // knows the last epoch only: may be an old one, played again
  EXPECT_EQ(farm.state("ingest/a"), JobState::Reconnect);
  EXPECT_EQ(farm.dispatcher->num_live_workers(), 0);
  EXPECT_EQ(events(), num_events);
  const WorkerOrders answer = farm.bus.sent["w"].back();
  EXPECT_TRUE(answer.reconciling) << "must not stop anything";
  EXPECT_EQ(answer.epoch, farm.dispatcher->epoch());
  worker.take(answer);
  farm.report(worker.report());
  EXPECT_EQ(farm.state("ingest/a"), JobState::Done);
}

TEST_F(DispatcherTest, OurOwnStallCostsNobodyTheLease) {
  farm.clock.now_ms += 3 * FakeFarm::kLeaseMs;
  farm.dispatcher->on_stall(3 * FakeFarm::kLeaseMs);
  farm.turn();
  EXPECT_EQ(farm.state("ingest/a"), JobState::Running);
  EXPECT_EQ(farm.store->worker_state("w"), "active");
  farm.clock.now_ms += FakeFarm::kLeaseMs;
  farm.turn();
  EXPECT_NE(farm.store->worker_state("w"), "active");
}

TEST_F(DispatcherTest, TurnThatCouldNotBeWrittenIsForgottenAndTheFarmGoesOn) {
  const AttemptRef b = attempt_of(worker, "ingest/b");
  worker.finish(attempt_of(worker, "ingest/a"));
  farm.store->begin();
  farm.dispatcher->on_report(worker.report(), farm.clock.now_ms);
  farm.dispatcher->on_tick(farm.clock.now_ms);
  farm.store->rollback();  // the disk was full
  farm.store->begin();
  farm.dispatcher->recover(farm.clock.now_ms);
  farm.store->commit();
  EXPECT_EQ(farm.state("ingest/a"), JobState::Reconnect);
  farm.sync(worker);
  EXPECT_EQ(farm.state("ingest/a"), JobState::Done);
  EXPECT_TRUE(worker.held().contains(b)) << "what runs goes on";
  farm.run_to_end(worker);
  EXPECT_EQ(shot_state(), "done");
  for (const auto& [job, num] : worker.num_runs) EXPECT_EQ(num, 1) << job;
  EXPECT_EQ(farm.store->num_planned(farm.shot).good, farm.store->num_planned(farm.shot).all);
}

TEST_F(DispatcherTest, FolderThatCannotBeWrittenHoldsClaimsBackAndIsTriedAgain) {
  worker.finish(attempt_of(worker, "ingest/a"));
  worker.finish(attempt_of(worker, "ingest/b"));
  const auto specs = farm.shot_folder() / ".vantage/specs";
  std::filesystem::remove_all(specs);
  write_file_atomically(specs, "a file where the folder should be");
  farm.sync(worker);
  EXPECT_EQ(farm.state("calibrate"), JobState::Ready);
  EXPECT_EQ(farm.num_attempts("calibrate"), 0);
  EXPECT_THAT(farm.dispatcher->trouble(), HasSubstr("calibrate.json: cannot be written"));
  std::filesystem::remove(specs);
  farm.clock.now_ms += 2'000;
  farm.sync(worker);
  EXPECT_EQ(farm.num_attempts("calibrate"), 1);
  EXPECT_EQ(farm.dispatcher->trouble(), "");
}

TEST_F(DispatcherTest, VeryShortJobsAreHandedOutAsManyAsBridgeACommit) {
  farm.num_edges = 700;
  for (const std::string done : {"ingest", "calibrate", "navspace"}) {
    while (!worker.held().empty()) worker.finish(worker.held().begin()->first);
    farm.sync(worker);
  }
  worker.finish(worker.held().begin()->first);
  WorkerReport r = worker.report();
  r.done_unacked.back().wall_ms = 0;
  farm.report(r);
  EXPECT_THAT(farm.bus.sent["w"].back().assigned, SizeIs(2 * (1 + 256)));
}

TEST_F(DispatcherTest, KindThatPublishesNothingIsBelievedAndLetsOthersGoOn) {
  farm.kinds[0].spec.publishes = "";  // ingest
  farm.kill();
  farm.start();
  farm.sync(worker);
  for (const std::string job : {"ingest/a", "ingest/b"}) {
    const AttemptRef ref = attempt_of(worker, job);
    worker.finish(ref);
    std::filesystem::remove_all(farm.shot_folder() / ".vantage/store/ingest");
  }
  farm.sync(worker);
  EXPECT_EQ(farm.state("ingest/a"), JobState::Done);
  EXPECT_EQ(farm.job("ingest/a").content, "nothing");
  EXPECT_EQ(farm.state("calibrate"), JobState::Leased);
  farm.submit();
  EXPECT_EQ(farm.state("ingest/a"), JobState::Done) << "a second submission does not run it again";
}

TEST_F(DispatcherTest, OvertakenReportIsIgnored) {
  const WorkerReport old = worker.report();
  worker.finish(attempt_of(worker, "ingest/a"));
  farm.report(worker.report());
  farm.report(old);
  EXPECT_EQ(farm.state("ingest/a"), JobState::Done);
}

TEST_F(DispatcherTest, AttemptThatNobodyOrderedIsAckedAndChangesNothing) {
  WorkerReport r = worker.report();
  r.done_unacked.push_back({.ref = {.job_id = farm.job("ingest/a").id.value, .number = 1, .token = 999},
                            .error_kind = "",
                            .message = "",
                            .content = "x"});
  farm.report(r);
  EXPECT_EQ(farm.state("ingest/a"), JobState::Running);
  EXPECT_THAT(farm.bus.sent["w"].back().acked, SizeIs(1));
}

TEST_F(DispatcherTest, ResultThatIsNotInTheStoreIsNotBelieved) {
  const AttemptRef ref = attempt_of(worker, "ingest/a");
  worker.finish(ref);
  std::filesystem::remove_all(farm.shot_folder() / ".vantage/store/ingest");
  farm.report(worker.report());
  EXPECT_EQ(farm.state("ingest/a"), JobState::Running) << "storage may lag";
  EXPECT_THAT(farm.bus.sent["w"].back().acked, IsEmpty());
  farm.clock.now_ms += 11'000;
  farm.report(worker.report());
  EXPECT_EQ(farm.state("ingest/a"), JobState::Ready);
  EXPECT_EQ(outcome(ref), "failed");
}

TEST_F(DispatcherTest, RestartedWorkerGivesBackAtOnceWithoutBlame) {
  worker.finish(attempt_of(worker, "ingest/b"));
  worker.restart();
  farm.sync(worker);
  EXPECT_EQ(farm.state("ingest/b"), JobState::Done) << "stood in the outbox";
  EXPECT_EQ(farm.num_attempts("ingest/a"), 2) << "handed out again in the same turn";
  EXPECT_EQ(farm.job("ingest/a").num_crashes, 0);
}

TEST_F(DispatcherTest, OrdersThatAreNotTakenUpGoToAnother) {
  FakeWorker deaf("deaf", 1);
  farm.sync(worker);
  worker.finish(attempt_of(worker, "ingest/a"));
  worker.finish(attempt_of(worker, "ingest/b"));
  farm.sync(deaf);  // free before the results arrive: gets calibrate
  farm.report(worker.report());
  ASSERT_FALSE(farm.bus.sent["deaf"].back().assigned.empty());
  farm.clock.now_ms += 6'000;
  farm.report(deaf.report());  // alive, but has never seen its orders
  EXPECT_EQ(farm.num_attempts("calibrate"), 2);
}

TEST_F(DispatcherTest, OrdersAreRepeatedUntilConfirmedThenEverySecond) {
  farm.clock.now_ms += 10'000;  // within the lease: worker is alive but silent
  worker.finish(attempt_of(worker, "ingest/a"));
  farm.report(worker.report());
  auto& sent = farm.bus.sent["w"];
  const auto num_at_first = sent.size();
  for (int ms = 0; ms < 1000; ms += 10) farm.clock.now_ms += 10, farm.turn();
  EXPECT_GE(sent.size(), num_at_first + 4);
  EXPECT_LE(sent.size(), num_at_first + 6);
  worker.take(sent.back());
  farm.report(worker.report());
  const auto num_confirmed = sent.size();
  for (int ms = 0; ms < 3000; ms += 10) farm.clock.now_ms += 10, farm.turn();
  EXPECT_LE(sent.size(), num_confirmed + 4);
}

TEST_F(DispatcherTest, TransientFailureBacksOffAndGivesUpAfterFiveTries) {
  for (int tries = 1; tries <= 5; ++tries) {
    const AttemptRef ref = attempt_of(worker, "ingest/a");
    ASSERT_EQ(ref.number, tries);
    worker.fail(ref, Outcome::Failed, ErrorKind::Transient, "disk hiccup");
    farm.sync(worker);
    if (tries == 5) break;
    EXPECT_EQ(farm.state("ingest/a"), JobState::Ready);
    EXPECT_GT(farm.job("ingest/a").not_before_ms, farm.clock.wall_ms());
    farm.clock.now_ms += 100;
    farm.sync(worker);
    EXPECT_EQ(attempt_of(worker, "ingest/a").number, 0) << "not before its time";
    for (int s = 0; s < 12; ++s) farm.clock.now_ms += 1'000, farm.sync(worker);
  }
  EXPECT_EQ(farm.state("ingest/a"), JobState::Failed);
  EXPECT_THAT(farm.job("ingest/a").reason, HasSubstr("disk hiccup"));
}

TEST_F(DispatcherTest, ResourceFailureIsTriedAgainWithMore) {
  worker.fail(attempt_of(worker, "ingest/a"), Outcome::Failed, ErrorKind::Resource, "out of memory");
  farm.sync(worker);
  EXPECT_EQ(farm.job("ingest/a").ram_mb, 1500);
  EXPECT_EQ(farm.num_attempts("ingest/a"), 2);
}

TEST_F(DispatcherTest, BadInputFailsAtOnce) {
  worker.fail(attempt_of(worker, "ingest/a"), Outcome::Failed, ErrorKind::BadInput, "a.mp4: is no video");
  farm.sync(worker);
  EXPECT_EQ(farm.state("ingest/a"), JobState::Failed);
  EXPECT_EQ(farm.state("navspace"), JobState::Aborted);
}

TEST_F(DispatcherTest, CrashedJobRunsAloneAndIsQuarantinedAfterThree) {
  worker.fail(attempt_of(worker, "ingest/a"), Outcome::Crashed, ErrorKind::Crash, "signal 11");
  farm.sync(worker);
  EXPECT_EQ(attempt_of(worker, "ingest/a").number, 0) << "ingest/b still runs there";
  worker.finish(attempt_of(worker, "ingest/b"));
  farm.sync(worker);
  for (int crashes = 2; crashes <= 3; ++crashes) {
    ASSERT_EQ(attempt_of(worker, "ingest/a").number, crashes);
    EXPECT_THAT(worker.held(), SizeIs(1));
    worker.fail(attempt_of(worker, "ingest/a"), Outcome::Crashed, ErrorKind::Crash, "signal 11");
    farm.sync(worker);
  }
  EXPECT_EQ(farm.state("ingest/a"), JobState::Quarantined);
  EXPECT_EQ(shot_state(), "failed");
}

TEST_F(DispatcherTest, DrainedWorkerGetsNothingNew) {
  farm.command({.verb = Command::Verb::Drain, .worker = "w"});
  worker.finish(attempt_of(worker, "ingest/a"));
  worker.finish(attempt_of(worker, "ingest/b"));
  farm.sync(worker);
  EXPECT_THAT(worker.held(), IsEmpty());
  EXPECT_TRUE(farm.bus.sent["w"].back().drain);
  farm.command({.verb = Command::Verb::Undrain, .worker = "w"});
  farm.sync(worker);
  EXPECT_THAT(worker.held(), SizeIs(1));
}

TEST_F(DispatcherTest, PausedShotStartsNothingNew) {
  farm.command({.verb = Command::Verb::Pause, .shot = farm.shot});
  worker.finish(attempt_of(worker, "ingest/a"));
  worker.finish(attempt_of(worker, "ingest/b"));
  farm.sync(worker);
  EXPECT_EQ(farm.state("calibrate"), JobState::Ready);
  farm.command({.verb = Command::Verb::Resume, .shot = farm.shot});
  EXPECT_EQ(farm.state("calibrate"), JobState::Leased);
}

TEST_F(DispatcherTest, CommandsToNobodySaySo) {
  EXPECT_THROW(farm.command({.verb = Command::Verb::Pause, .shot = ShotId{99}}), Error);
  EXPECT_THROW(farm.command({.verb = Command::Verb::Cancel, .job = JobId{99}}), Error);
  EXPECT_THROW(farm.command({.verb = Command::Verb::Drain, .worker = "nobody"}), Error);
}

TEST_F(DispatcherTest, RestartAdoptsRunningByTokenAndAcceptsWhatFinishedMeanwhile) {
  const AttemptRef a = attempt_of(worker, "ingest/a"), b = attempt_of(worker, "ingest/b");
  farm.kill();
  worker.finish(b);
  farm.clock.now_ms += 5'000;
  farm.start();
  EXPECT_EQ(farm.dispatcher->epoch(), 2);
  EXPECT_EQ(farm.state("ingest/a"), JobState::Reconnect);
  farm.sync(worker);
  EXPECT_EQ(farm.state("ingest/a"), JobState::Running);
  EXPECT_EQ(farm.state("ingest/b"), JobState::Done);
  EXPECT_TRUE(worker.held().contains(a)) << "a restarted scheduler must not stop what runs";
  farm.run_to_end(worker);
  EXPECT_EQ(shot_state(), "done");
  for (const auto& [job, num] : worker.num_runs) EXPECT_EQ(num, 1) << job;
}

TEST_F(DispatcherTest, RestartSalvagesResultsOfWorkersThatDiedToo) {
  worker.finish(attempt_of(worker, "ingest/a"));
  farm.kill();
  farm.start();
  FakeWorker fresh("fresh", 2);
  farm.sync(fresh);
  EXPECT_THAT(fresh.held(), IsEmpty()) << "what may still run elsewhere is waited for";
  for (int s = 0; s <= 15; ++s) farm.clock.now_ms += 1'000, farm.sync(fresh);
  EXPECT_EQ(farm.state("ingest/a"), JobState::Done);
  EXPECT_EQ(farm.num_attempts("ingest/a"), 1);
  EXPECT_EQ(farm.num_attempts("ingest/b"), 2);
  farm.run_to_end(fresh);
  EXPECT_EQ(shot_state(), "done");
}

TEST_F(DispatcherTest, RestartWithAWorkerOfTheSameNameRunsItsJobsAgainAtOnce) {
  farm.kill();
  farm.start();
  worker.restart();
  farm.sync(worker);
  EXPECT_THAT(worker.held(), SizeIs(2));
  EXPECT_EQ(farm.num_attempts("ingest/a"), 2);
}

TEST_F(DispatcherTest, EditStopsRunningJobsThatItReachesOnly) {
  worker.finish(attempt_of(worker, "ingest/a"));
  worker.finish(attempt_of(worker, "ingest/b"));
  farm.sync(worker);
  const AttemptRef calibrate = attempt_of(worker, "calibrate");
  ASSERT_NE(calibrate.number, 0);
  farm.submit();
  EXPECT_EQ(farm.state("calibrate"), JobState::Leased) << "nothing changed: goes on";
  farm.sigma = 9;
  farm.submit();
  EXPECT_EQ(outcome(calibrate), "canceled");
  EXPECT_THAT(farm.bus.sent["w"].back().canceled, testing::Contains(calibrate));
  EXPECT_EQ(farm.num_attempts("calibrate"), 2);
  EXPECT_EQ(farm.job("calibrate").reason, "params.sigma 1.2 → 9.0");
}

TEST_F(DispatcherTest, ShortJobsAreHandedOutOneAheadPerSlotLongOnesAreNot) {
  farm.num_edges = 20;
  for (const std::string done : {"ingest", "calibrate", "navspace"}) {
    while (!worker.held().empty()) worker.finish(worker.held().begin()->first);
    farm.sync(worker);
  }
  EXPECT_THAT(worker.held(), SizeIs(2)) << "how long they take is not known yet";
  worker.finish(worker.held().begin()->first);  // FakeWorker's jobs take 5 s
  farm.sync(worker);
  EXPECT_THAT(worker.held(), SizeIs(2));
  WorkerReport r = worker.report();
  worker.finish(worker.held().begin()->first);
  r = worker.report();
  r.done_unacked.back().wall_ms = -40'000;  // as many short ones would: a mean below the limit
  farm.report(r);
  EXPECT_THAT(farm.bus.sent["w"].back().assigned, SizeIs(4));
}

}  // namespace
}  // namespace vantage
