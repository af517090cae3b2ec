/// How soon, and how gently, the farm is itself again: killed and stopped workers, killed schedulers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include "schema/base/clock.h"
#include "schema/base/files.h"
#include "schema/base/json.h"
#include "schema/base/program.h"
#include "tests/faults/farm_facts.h"
#include "tests/support/temporary_folder.h"

namespace vantage::faults {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr int kLease_ms = 2000;
constexpr double kPatience_s = 30;

class Recovery : public testing::Test {
 protected:
  Recovery() : farm(folder.path(), {.lease_ms = kLease_ms}) { farm.start(); }
  std::int64_t submit(const std::string& tables) {
    write_short_shot(shot(), tables);
    return farm.submit(shot());
  }
  fs::path shot() const { return folder.path() / "shot"; }
  std::string worker_of(const std::string& job) const {
    for (const AttemptFact& attempt : attempts_of(farm))
      if (attempt.job == job) return attempt.worker_id;
    return "";
  }
  static std::int64_t wall_ms() { return system_clock().wall_ms(); }

  TemporaryFolder folder;
  ShortFarm farm;
};

/// All of a worker: itself and the jobs that it runs.
void signal_all(const ShortWorker& worker, int number) {
  for (const pid_t child : worker.children()) kill(child, number);
  for (const pid_t server : worker.fork_server()) kill(server, number);
  kill(worker.pid(), number);
}

TEST_F(Recovery, AKilledWorkersJobGoesToAnotherWithinALeaseAndASecond) {
  ShortWorker first(farm, "first", {.slots = 1});
  const auto id = submit("[trouble]\nslow = 1\nslow_ms = 4000\n");
  ASSERT_TRUE(wait_for_running(farm, "trouble/slow-0", 1, kPatience_s));
  ShortWorker second(farm, "second", {.slots = 1});
  ASSERT_TRUE(wait_until([&] { return farm.get("/workers").at("workers").size() == 2; }, kPatience_s));

  const std::int64_t killed_ms = wall_ms();
  first.kill();
  ASSERT_TRUE(wait_until([&] { return job_of(farm, "trouble/slow-0").num_attempts == 2; }, kPatience_s));
  const auto attempts = attempts_of(farm);
  const std::int64_t after_ms = attempts.back().leased_ms - killed_ms;
  std::printf("redispatched %ld ms after the kill, lease %d ms\n", static_cast<long>(after_ms), kLease_ms);
  EXPECT_LE(after_ms, kLease_ms + 1000);
  EXPECT_EQ(attempts.back().worker_id, second.id());
  EXPECT_EQ(wait_for_end(farm, id, kPatience_s), "done");
  expect_all_done_once(farm, shot());
  EXPECT_THAT(farm.ask({"why", shot(), "trouble/slow-0"}), HasSubstr("was not heard of: the lease ran out"));
  EXPECT_THAT(farm.ask({"workers"}), HasSubstr("lost"));
}

TEST_F(Recovery, ARestartedSchedulerDispatchesWithinASecondAndAdoptsWhatRuns) {
  ShortWorker worker(farm, "worker", {.slots = 2});
  const auto id = submit("[seed]\nnum_jobs = 200\npause_ms = 20\n[trouble]\nslow = 1\nslow_ms = 5000\n");
  ASSERT_TRUE(wait_for_running(farm, "trouble/slow-0", 1, kPatience_s));
  ASSERT_TRUE(wait_until([&] { return num_jobs_in(farm, "done") > 20; }, kPatience_s));

  farm.kill();
  const std::size_t num_before = attempts_of(farm).size();
  const std::int64_t restarted_ms = wall_ms();
  farm.start();
  ASSERT_TRUE(wait_until([&] { return attempts_of(farm).size() > num_before; }, kPatience_s));
  const std::int64_t after_ms = attempts_of(farm)[num_before].leased_ms - restarted_ms;
  std::printf("dispatching %ld ms after the start\n", static_cast<long>(after_ms));
  EXPECT_LE(after_ms, 1000);
  EXPECT_EQ(wait_for_end(farm, id, 60), "done");
  expect_all_done_once(farm, shot());
  for (const JobFact& job : jobs_of(farm)) EXPECT_EQ(job.num_attempts, 1) << job.name << " was not adopted";
}

TEST_F(Recovery, ASchedulerAwayForLongerThanALeaseFindsWhatWasFinishedMeanwhile) {
  ShortWorker worker(farm, "worker", {.slots = 2});
  const auto id = submit("[trouble]\nslow = 2\nslow_ms = 1500\n");
  ASSERT_TRUE(wait_for_running(farm, "trouble/slow-1", 1, kPatience_s));
  farm.kill();
  ASSERT_TRUE(wait_until([&] { return worker.children().empty(); }, kPatience_s));
  usleep((kLease_ms + 500) * 1000);
  farm.start();
  EXPECT_EQ(wait_for_end(farm, id, kPatience_s), "done");
  expect_all_done_once(farm, shot());
  for (const JobFact& job : jobs_of(farm)) EXPECT_EQ(job.num_attempts, 1) << job.name;
}

TEST_F(Recovery, AStoppedWorkerThatGoesOnAfterItsLeaseDoesNoHarm) {
  ShortWorker sleeper(farm, "sleeper", {.slots = 1});
  const auto id = submit("[trouble]\nslow = 1\nslow_ms = 2500\n");
  ASSERT_TRUE(wait_for_running(farm, "trouble/slow-0", 1, kPatience_s));
  signal_all(sleeper, SIGSTOP);
  ShortWorker other(farm, "other", {.slots = 1});
  ASSERT_TRUE(wait_for_running(farm, "trouble/slow-0", 2, kPatience_s)) << "the job went to the other worker";
  signal_all(sleeper, SIGCONT);
  EXPECT_EQ(wait_for_end(farm, id, kPatience_s), "done");
  expect_all_done_once(farm, shot());
  EXPECT_TRUE(wait_until([&] { return sleeper.children().empty(); }, 5)) << "what nobody wants any more was stopped";
  EXPECT_EQ(attempts_of(farm).front().outcome, "lost");
  EXPECT_TRUE(wait_until([&] { return farm.ask({"workers"}).find("lost") == std::string::npos; }, kPatience_s))
      << "who is back is not lost";
}

/// Only the worker sleeps; its job goes on and commits: that result is found and nothing is done again.
TEST_F(Recovery, AResultThatCameWhileItsWorkerSleptIsUsed) {
  ShortWorker sleeper(farm, "sleeper", {.slots = 1});
  const auto id = submit("[trouble]\nslow = 1\nslow_ms = 500\n");
  ASSERT_TRUE(wait_for_running(farm, "trouble/slow-0", 1, kPatience_s));
  sleeper.signal(SIGSTOP);
  EXPECT_EQ(wait_for_end(farm, id, kPatience_s), "done");
  sleeper.signal(SIGCONT);
  expect_all_done_once(farm, shot());
  EXPECT_EQ(job_of(farm, "trouble/slow-0").num_attempts, 1);
  EXPECT_TRUE(wait_until(
      [&] { return fs::exists(sleeper.state() / "outbox.json") && read_json(sleeper.state() / "outbox.json").empty(); },
      5))
      << "the late report is acknowledged";
}

/// A machine was cloned with its worker's folder.
TEST_F(Recovery, TwoWorkersWithOneIdDoNothingTwice) {
  ShortWorker original(farm, "original", {.slots = 1});
  const auto id = submit("[seed]\nnum_jobs = 30\npause_ms = 100\n[trouble]\nslow = 1\nslow_ms = 1500\n");
  ASSERT_TRUE(wait_for_running(farm, "trouble/slow-0", 1, kPatience_s));
  fs::create_directories(folder.path() / "clone");
  fs::copy(original.state() / "worker.json", folder.path() / "clone/worker.json");
  ShortWorker clone(farm, "clone", {.slots = 1});
  EXPECT_EQ(wait_for_end(farm, id, 60), "done");
  EXPECT_EQ(original.id(), clone.id());
  expect_all_done_once(farm, shot());
  // The older one gives way, and says how both can work.
  EXPECT_TRUE(wait_until([&] { return !original.is_running(); }, 5));
  EXPECT_THAT(original.printed(), HasSubstr("another worker with this identity"));
}

TEST_F(Recovery, AWorkerWhoseParentIsGoneBeforeItBeganEndsByItself) {
  const std::string nobody = "999999999";
  const int status = run_program(
      {"timeout", "20", VANTAGE_BIN "/vantage-short-worker", "--bus", "tcpq://127.0.0.1:1", "--farm-key",
       (farm.state() / "farm.key").string(), "--state", (folder.path() / "orphan").string(), "--parent", nobody},
      {});
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace vantage::faults
