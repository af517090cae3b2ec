/// kill -9 of scheduler, workers and children at arbitrary moments: the run ends complete, its artifacts equal to an
/// undisturbed run's, and no job that had finished is done again.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <thread>

#include "tests/e2e/farm_under_test.h"
#include "tests/support/temporary_folder.h"

namespace vantage::e2e {
namespace {
namespace fs = std::filesystem;

const std::string kBin = VANTAGE_BIN;

void make_shot(const fs::path& shot) {
  const Ended made = run({kBin + "/vantage-demo-shot", shot, "--known", "--cameras", "3", "--frames", "5", "--width",
                          "160", "--height", "90"});
  ASSERT_EQ(made.exit_code, 0) << made.output;
}

enum class Victim { Scheduler, Worker, Child };

/// Kills one process of the kind below `scheduler`; false when there is none at the moment.
bool kill_one(Victim victim, pid_t scheduler, std::mt19937& random) {
  std::vector<pid_t> candidates;
  if (victim == Victim::Scheduler) candidates = {scheduler};
  for (const pid_t worker : children_of(scheduler)) {
    if (victim == Victim::Worker) candidates.push_back(worker);
    if (victim == Victim::Child)
      for (const pid_t fork_server : children_of(worker))
        for (const pid_t child : children_of(fork_server)) candidates.push_back(child);
  }
  if (candidates.empty()) return false;
  return kill(candidates[random() % candidates.size()], SIGKILL) == 0;
}

TEST(KillAndResume, KilledProcessesLoseNothingAndRepeatNothing) {
  const TemporaryFolder folder;
  const fs::path calm = folder.path() / "calm", stormy = folder.path() / "stormy";
  make_shot(calm);
  make_shot(stormy);
  const Ended undisturbed = run({kBin + "/vantage", "run", calm, "--workers", "2"});
  ASSERT_EQ(undisturbed.exit_code, 0) << undisturbed.output;

  std::mt19937 random(20110601);
  std::vector<Victim> victims{Victim::Scheduler, Victim::Worker, Victim::Child,
                              Victim::Child,     Victim::Worker, Victim::Scheduler};
  const std::vector<std::string> command{kBin + "/vantage", "run", stormy, "--workers", "2"};
  auto farm = std::make_unique<Running>(command, folder.path() / "stormy.txt");
  for (const Victim victim : victims) {
    std::this_thread::sleep_for(std::chrono::milliseconds(700 + random() % 900));
    for (int tries = 0; tries < 200 && !farm->ended() && !kill_one(victim, farm->pid(), random); ++tries)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    if (victim == Victim::Scheduler || farm->ended()) {
      farm->wait();
      farm = std::make_unique<Running>(command, folder.path() / "stormy.txt");
    }
  }
  EXPECT_EQ(farm->wait(), 0);
  const Ended last = run(command);
  EXPECT_EQ(last.exit_code, 0) << last.output;

  EXPECT_EQ(contents_by_job(stormy), contents_by_job(calm));
  for (const auto& [job, count] : done_attempts_by_job(stormy))
    EXPECT_EQ(count, 1) << job << " was done more than once";
}

}  // namespace
}  // namespace vantage::e2e
