/// Which worker gets which job: pools, tags, kinds, what failed where, self-tests, hours.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ctime>

#include "schema/base/error.h"
#include "tests/support/fake_farm.h"

namespace vantage {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using Verb = Command::Verb;

class WorkerTrustTest : public testing::Test {
 protected:
  void SetUp() override {
    farm.num_edges = 12;
    farm.submit();
  }
  void shot_says(const std::string& more) {
    write_file_atomically(farm.shot_folder() / "shot.toml",
                          "[shot]\nname = \"fake\"\n[[camera]]\nname = \"a\"\nfootage = \"a.mp4\"\n"
                          "[[camera]]\nname = \"b\"\nfootage = \"b.mp4\"\n" +
                              more);
    farm.submit();
  }
  void sync(FakeWorker& w, int times = 2) {
    for (int i = 0; i < times; ++i) {
      farm.clock.now_ms += 100;
      farm.sync(w);
    }
  }
  /// Both take part; the first ends what it holds until correspond jobs are ready.
  void run_to_edges(FakeWorker& w) {
    for (int round = 0; round < 40; ++round) {
      sync(w, 1);
      if (!w.held().empty() && kind_of(w.held().begin()->second) == "correspond") return;
      if (!w.held().empty()) w.finish(w.held().begin()->first);
    }
    FAIL();
  }
  static std::string kind_of(const Assignment& a) { return read_job_file(a.spec_path).kind; }
  std::string fail_one(FakeWorker& w, Outcome outcome = Outcome::Crashed, ErrorKind kind = ErrorKind::Crash) {
    const auto [ref, assignment] = *w.held().begin();
    const std::string job = read_job_file(assignment.spec_path).job;
    w.fail(ref, outcome, kind, "it broke");
    sync(w, 1);
    return job;
  }
  void offers_selftest(FakeWorker& w) {
    w.machine().kinds = {"ingest/1", "calibrate/1", "navspace/1", "correspond/1", "encode/1", "selftest/1"};
  }
  std::string row(const FakeWorker& w, const std::string& column) {
    return farm.store->db().text_or("?", "SELECT " + column + " FROM worker WHERE id = ?", w.id());
  }
  std::string last_decision() {
    return farm.store->db().text_or("", "SELECT text FROM event WHERE kind = 'decision' ORDER BY id DESC LIMIT 1");
  }

  FakeFarm farm;
  FakeWorker worker{"w", 2}, other{"x", 2};
};

TEST_F(WorkerTrustTest, JobsOfAPoolWaitForAWorkerOfIt) {
  shot_says("[farm]\npool = \"night\"\n");
  sync(worker);
  EXPECT_THAT(worker.held(), IsEmpty());
  other.machine().pool = "night";
  sync(other);
  EXPECT_THAT(other.held(), SizeIs(2));
}

TEST_F(WorkerTrustTest, WorkerNeedsAllTagsAndAKindMayHaveItsOwn) {
  shot_says("[farm]\ntags = [\"gpu\", \"bigmem\"]\n[calibrate]\ntags = []\n");
  worker.machine().tags = {"gpu"};
  other.machine().tags = {"bigmem", "fast", "gpu"};
  sync(worker);
  sync(other);
  EXPECT_THAT(worker.held(), IsEmpty());
  ASSERT_THAT(other.held(), SizeIs(2));
  while (!other.held().empty()) other.finish(other.held().begin()->first);
  sync(other, 1);
  sync(worker);
  EXPECT_TRUE(is_active(farm.state("calibrate")));
}

TEST_F(WorkerTrustTest, PoolsAndTagsAreNotPartOfTheKey) {
  farm.run_to_end(worker);
  shot_says("[farm]\npool = \"night\"\ntags = [\"gpu\"]\n");
  EXPECT_EQ(farm.store->shot(farm.shot)->state, "done") << "nothing has to run again";
  EXPECT_EQ(farm.job("navspace").pool, "night");
}

TEST_F(WorkerTrustTest, BadTagsAreNamedWithTheirLine) {
  try {
    shot_says("[farm]\ntags = [\"two words\"]\n");
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("shot.toml:10: tags is [\"two words\"], expected a list of words"));
  }
}

TEST_F(WorkerTrustTest, KindsThatAWorkerCannotRunAreNotGivenToIt) {
  worker.machine().kinds = {"calibrate/1", "ingest/2"};
  sync(worker);
  EXPECT_THAT(worker.held(), IsEmpty()) << "another version is another kind";
  worker.machine().kinds = {"ingest/1"};
  sync(worker);
  EXPECT_THAT(worker.held(), SizeIs(2));
}

TEST_F(WorkerTrustTest, TroubleTakesNoWorkUntilItIsOver) {
  worker.machine().trouble = "disk full: /store has 12 MB";
  sync(worker);
  EXPECT_THAT(worker.held(), IsEmpty());
  EXPECT_EQ(row(worker, "state"), "in trouble");
  worker.machine().trouble = "";
  sync(worker);
  EXPECT_THAT(worker.held(), SizeIs(2));
}

TEST_F(WorkerTrustTest, FailedJobGoesToAnotherWorker) {
  sync(worker);
  sync(other);  // nothing left, but there
  const std::string job = fail_one(worker);
  sync(worker, 3);
  EXPECT_THAT(worker.held(), SizeIs(1)) << "has room, but failed at it";
  sync(other);
  ASSERT_THAT(other.held(), SizeIs(1));
  EXPECT_EQ(read_job_file(other.held().begin()->second.spec_path).job, job);
}

TEST_F(WorkerTrustTest, TheOnlyWorkerThatFitsMayTryAgain) {
  other.machine().pool = "elsewhere";
  shot_says("[ingest]\npool = \"here\"\n");
  worker.machine().pool = "here";
  sync(worker);
  sync(other);
  while (!worker.held().empty()) fail_one(worker, Outcome::Failed, ErrorKind::Resource);
  EXPECT_EQ(farm.num_attempts("ingest/a"), 3) << "all its tries";
}

TEST_F(WorkerTrustTest, ThreeDifferentJobsInARowSetAsideUntilTheSelfTestIsPassed) {
  offers_selftest(worker);
  offers_selftest(other);
  run_to_edges(worker);
  sync(other);
  for (int i = 0; i < 3; ++i) {
    ASSERT_FALSE(worker.held().empty());
    fail_one(worker, Outcome::Failed, ErrorKind::Transient);
  }
  EXPECT_EQ(row(worker, "state"), "set aside");
  EXPECT_THAT(row(worker, "set_aside"), HasSubstr("3 different jobs failed there in a row"));
  sync(worker);
  ASSERT_FALSE(worker.held().empty());
  const auto test = std::find_if(worker.held().begin(), worker.held().end(),
                                 [](const auto& held) { return kind_of(held.second) == "selftest"; });
  ASSERT_NE(test, worker.held().end());
  for (const AttemptRef ref = test->first; worker.held().size() > 1;)
    for (const auto& [held, assignment] : std::map(worker.held()))
      if (held != ref) worker.finish(held);
  sync(worker);
  ASSERT_THAT(worker.held(), SizeIs(1)) << "nothing else meanwhile";
  worker.finish(worker.held().begin()->first);
  sync(worker);
  EXPECT_EQ(row(worker, "state"), "active");
  EXPECT_EQ(row(worker, "set_aside"), "");
  EXPECT_THAT(last_decision(), HasSubstr("passes its self-test and takes work again"));
  EXPECT_FALSE(worker.held().empty());
  EXPECT_EQ(farm.store->db().integer_or(-1, "SELECT count(*) FROM job_count WHERE kind = 'selftest' AND num > 0"), 0)
      << "no shot counts it";
}

TEST_F(WorkerTrustTest, FailedSelfTestSaysWhyAndIsTriedAgainLater) {
  offers_selftest(worker);
  sync(worker);
  while (!worker.held().empty()) worker.finish(worker.held().begin()->first);
  farm.command({.verb = Verb::SelfTest, .worker = "w", .who = "ana"});
  sync(worker, 1);
  const auto test = std::find_if(worker.held().begin(), worker.held().end(),
                                 [](const auto& held) { return kind_of(held.second) == "selftest"; });
  ASSERT_NE(test, worker.held().end());
  worker.fail(test->first, Outcome::Failed, ErrorKind::Transient, "self-test failed: disk: no room");
  sync(worker);
  EXPECT_EQ(row(worker, "set_aside"), "self-test failed: disk: no room");
  const auto num_tests = [&] {
    return farm.store->db().integer_or(0, "SELECT num_attempts FROM job WHERE kind = 'selftest'");
  };
  EXPECT_EQ(num_tests(), 1);
  for (int minute = 0; minute <= 11; ++minute)
    for (int s = 0; s < 60; s += 10) farm.clock.now_ms += 10'000, farm.sync(worker);
  EXPECT_EQ(num_tests(), 2);
}

TEST_F(WorkerTrustTest, SelfTestSurvivesANewPlanAndARestart) {
  offers_selftest(worker);
  sync(worker);
  farm.command({.verb = Verb::SelfTest, .worker = "w"});
  sync(worker, 1);
  farm.submit();
  EXPECT_TRUE(is_active(farm.state("selftest/w")));
  farm.kill();
  farm.start();
  sync(worker);
  EXPECT_EQ(farm.state("selftest/w"), JobState::Running);
}

TEST_F(WorkerTrustTest, SetAsideOutlivesTheSchedulerAndForgivingEndsIt) {
  offers_selftest(worker);
  run_to_edges(worker);
  sync(other);
  for (int i = 0; i < 3; ++i) fail_one(worker, Outcome::Failed, ErrorKind::Transient);
  farm.kill();
  farm.start();
  sync(worker);
  EXPECT_EQ(row(worker, "state"), "set aside");
  farm.command({.verb = Verb::Forgive, .worker = "w"});
  EXPECT_EQ(row(worker, "state"), "active");
  EXPECT_EQ(farm.store->db().integer_or(-1, "SELECT count(*) FROM worker_failure"), 0);
}

TEST_F(WorkerTrustTest, KindThatFailsOnAWorkerIsNotGivenThereWhileOthersCanDoIt) {
  // Without a self-test nobody is set aside; three edges fail there.
  run_to_edges(worker);
  sync(other);
  for (int i = 0; i < 3; ++i) {
    ASSERT_FALSE(worker.held().empty());
    fail_one(worker, Outcome::Failed, ErrorKind::Transient);
  }
  while (!worker.held().empty()) worker.finish(worker.held().begin()->first);
  EXPECT_EQ(row(worker, "set_aside"), "");
  farm.command({.verb = Verb::Drain, .worker = "x"});
  sync(worker);
  EXPECT_FALSE(worker.held().empty()) << "the only one that takes work";
}

TEST_F(WorkerTrustTest, OutsideItsHoursAWorkerFinishesWhatRunsAndTakesNothing) {
  const std::time_t now_s = farm.clock.wall_ms() / 1000;
  std::tm local{};
  localtime_r(&now_s, &local);
  sync(worker);
  ASSERT_THAT(worker.held(), SizeIs(2));
  const std::string hours = fmt::format("{:02}:{:02}-{:02}:{:02}", (local.tm_hour + 1) % 24, local.tm_min,
                                        (local.tm_hour + 2) % 24, local.tm_min);
  const CommandResult result = farm.command({.verb = Verb::Hours, .worker = "w", .hours = hours});
  EXPECT_THAT(result.text, HasSubstr("works " + hours + ", from "));
  sync(worker);
  EXPECT_THAT(worker.held(), SizeIs(2)) << "goes on with what it has";
  while (!worker.held().empty()) worker.finish(worker.held().begin()->first);
  sync(worker);
  EXPECT_THAT(worker.held(), IsEmpty());
  EXPECT_EQ(row(worker, "state"), "off hours");
  farm.clock.now_ms += 3'600'000;
  sync(worker, 3);
  EXPECT_THAT(worker.held(), SizeIs(1)) << "calibrate, an hour later";
}

TEST_F(WorkerTrustTest, HoursOutliveTheSchedulerAndOffEndsThem) {
  sync(worker);
  farm.command({.verb = Verb::Hours, .worker = "w", .hours = "sat-sun"});
  farm.kill();
  farm.start();
  sync(worker);
  EXPECT_EQ(row(worker, "hours"), "sat-sun");
  farm.command({.verb = Verb::Hours, .worker = "w", .hours = ""});
  EXPECT_EQ(row(worker, "state"), "active");
  EXPECT_THROW(farm.command({.verb = Verb::Hours, .worker = "w", .hours = "monday"}), Error);
}

}  // namespace
}  // namespace vantage
