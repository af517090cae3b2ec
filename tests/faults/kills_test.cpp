/// kill -9 of scheduler, workers and children at random moments, two hundred times in a run of two thousand jobs.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <random>
#include <thread>

#include "tests/faults/farm_facts.h"
#include "tests/support/temporary_folder.h"

namespace vantage::faults {
namespace {
namespace fs = std::filesystem;

constexpr int kNumKills = 200;
constexpr const char* kTables =
    "[seed]\nnum_jobs = 1000\npause_ms = 25\n[mix]\nnum_jobs = 1000\npause_ms = 25\n[join]\nnum_jobs = 100\n";

/// Seed of the run: from the environment to repeat one, else new every time.
unsigned seed() {
  const char* given = std::getenv("VANTAGE_TEST_SEED");
  return given != nullptr ? static_cast<unsigned>(std::stoul(given)) : std::random_device{}();
}

class Storm {
 public:
  Storm(ShortFarm& farm, std::vector<std::unique_ptr<ShortWorker>>& workers, unsigned seed)
      : farm_(farm), workers_(workers), random_(seed) {}

  /// One kill; what died is started again at once, but for children, whose worker goes on.
  void strike() {
    const int dice = static_cast<int>(random_() % 10);
    if (dice < 2)
      kill_scheduler();
    else if (dice < 5)
      kill_worker();
    else
      kill_child(dice == 9);
  }

  int num_schedulers = 0, num_workers = 0, num_children = 0;
  int num_kills() const { return num_schedulers + num_workers + num_children; }

 private:
  void kill_scheduler() {
    farm_.kill();
    farm_.start();
    ++num_schedulers;
  }
  void kill_worker() {
    ShortWorker& worker = *workers_[random_() % workers_.size()];
    worker.kill();
    worker.start();
    ++num_workers;
  }
  /// A job, or what forks a worker's jobs, and with it all of them.
  void kill_child(bool fork_servers) {
    std::vector<pid_t> children;
    const auto any = [&] {
      for (const auto& worker : workers_)
        for (const pid_t child : fork_servers ? worker->fork_server() : worker->children()) children.push_back(child);
      return !children.empty();
    };
    if (wait_until(any, 0.5) && ::kill(children[random_() % children.size()], SIGKILL) == 0) ++num_children;
  }

  ShortFarm& farm_;
  std::vector<std::unique_ptr<ShortWorker>>& workers_;
  std::mt19937 random_;
};

std::map<std::string, std::string> undisturbed(const fs::path& folder) {
  ShortFarm farm(folder);
  farm.start();
  ShortWorker worker(farm, "worker", {.slots = 4});
  write_short_shot(folder / "shot", kTables);
  EXPECT_EQ(wait_for_end(farm, farm.submit(folder / "shot"), 120), "done");
  return contents_of(farm);
}

TEST(Kills, TwoHundredAtRandomLoseNothingAndRepeatNothing) {
  const TemporaryFolder folder;
  const auto calm = undisturbed(folder.path() / "calm");
  const unsigned number = seed();
  std::printf("VANTAGE_TEST_SEED=%u repeats this run\n", number);

  const fs::path shot = folder.path() / "stormy/shot", journal = folder.path() / "journal";
  write_short_shot(shot, kTables);
  ShortFarm farm(folder.path() / "stormy");
  farm.start();
  std::vector<std::unique_ptr<ShortWorker>> workers;
  for (const char* name : {"w1", "w2", "w3"})
    workers.push_back(std::make_unique<ShortWorker>(
        farm, name,
        ShortWorker::Settings{.slots = 2, .place = {.environment = {"VANTAGE_SHORT_JOURNAL=" + journal.string()}}}));
  const std::int64_t id = farm.submit(shot);

  Storm storm(farm, workers, number);
  std::mt19937 random(number + 1);
  const auto start = std::chrono::steady_clock::now();
  while (storm.num_kills() < kNumKills && shot_state(farm, id) == "running") {
    std::this_thread::sleep_for(std::chrono::milliseconds(random() % 120));
    storm.strike();
  }
  EXPECT_GE(storm.num_kills(), kNumKills) << "the run ended too early to be hurt enough";
  // A job that the storm happened to hit three times is set aside, as it should be; a person lets it try again.
  std::string state = wait_for_end(farm, id, 120);
  const int num_quarantined = num_jobs_in(farm, "quarantined");
  for (int tries = 0; state == "failed" && tries < 3; ++tries) {
    farm.post("/shots/" + std::to_string(id) + "/retry", Json::object());
    state = wait_for_end(farm, id, 60);
  }
  EXPECT_EQ(state, "done");
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::printf("killed: %d schedulers, %d workers, %d children in %.1f s; %d jobs set aside; %zu attempts of %zu jobs\n",
              storm.num_schedulers, storm.num_workers, storm.num_children, wall_s, num_quarantined,
              attempts_of(farm).size(), jobs_of(farm).size());

  expect_all_done_once(farm, shot, journal);
  EXPECT_EQ(contents_of(farm), calm);
  for (const auto& worker : workers)
    EXPECT_TRUE(wait_until([&] { return worker->children().empty(); }, 5)) << "the farm ends idle";
}

}  // namespace
}  // namespace vantage::faults
