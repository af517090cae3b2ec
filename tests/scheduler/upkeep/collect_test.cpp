#include "scheduler/upkeep/collect.h"

#include <gtest/gtest.h>
#include <sys/file.h>

#include <atomic>
#include <random>
#include <thread>

#include "scheduler/farm/store_users.h"
#include "scheduler/farm/turn_lock.h"
#include "schema/base/error.h"
#include "tests/support/fake_farm.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

constexpr std::int64_t kFarFuture_ms = 4'000'000'000'000;  // everything is old enough

class GarbageOfAShot : public testing::Test {
 protected:
  fs::path store() const { return fs::canonical(farm_.shot_folder() / ".vantage" / "store"); }
  fs::path state_dir() const { return farm_.database().parent_path(); }
  CollectOptions options(std::function<void()> between = nullptr) const {
    return {.store = store(),
            .state_dirs = {state_dir()},
            .ages = {.now_ms = kFarFuture_ms, .keep_ms = 0, .keep_logs_ms = kFarFuture_ms, .max_log_bytes = ~0ULL},
            .between = std::move(between)};
  }
  void run() {
    farm_.submit();
    farm_.run_to_end(worker_);
    ASSERT_EQ(farm_.store->shot(farm_.shot)->state, "done");
  }
  bool has_artifact(const std::string& kind, const std::string& key) const {
    return read_valid_manifest(artifact_folder(store(), kind, key)).has_value();
  }
  FakeFarm farm_;
  FakeWorker worker_{"w", 4};
};

TEST_F(GarbageOfAShot, ResultsOfTheOldPlanGoAndThoseOfThePresentStay) {
  run();
  const std::string old_encode = farm_.job("encode").key, calibrate = farm_.job("calibrate").key;
  farm_.gain = 2;
  run();
  const Collected done = collect_garbage(options());
  EXPECT_FALSE(has_artifact("encode", old_encode));
  EXPECT_TRUE(has_artifact("calibrate", calibrate));
  EXPECT_TRUE(has_artifact("encode", farm_.job("encode").key));
  ASSERT_EQ(done.removed.size(), 1U);
  EXPECT_GT(done.removed[0].num_bytes, 0U);
}

TEST_F(GarbageOfAShot, LookingRemovesNothingAndAgeSpares) {
  run();
  farm_.gain = 2;
  run();
  auto ages = options().ages;
  EXPECT_EQ(find_garbage(store(), reach_of(store(), {state_dir()}), ages).size(), 1U);
  ages.keep_ms = kFarFuture_ms;
  EXPECT_TRUE(find_garbage(store(), reach_of(store(), {state_dir()}), ages).empty());
  EXPECT_EQ(collect_garbage(options()).removed.size(), 1U);
}

TEST_F(GarbageOfAShot, WhatALinkInOutPointsToStays) {
  run();
  const std::string old_encode = farm_.job("encode").key;
  farm_.gain = 2;
  run();
  fs::create_directories(farm_.shot_folder() / "out");
  fs::create_symlink("../.vantage/store/encode/" + old_encode + "/out.json", farm_.shot_folder() / "out" / "kept.json");
  EXPECT_TRUE(collect_garbage(options()).removed.empty());
  EXPECT_TRUE(has_artifact("encode", old_encode));
}

/// The planner has looked, and found the old result; its commit comes when gc has moved that away.
TEST_F(GarbageOfAShot, AnOldResultThatATurnHasJustFoundIsPutBack) {
  run();
  const std::string old_encode = farm_.job("encode").key;
  farm_.gain = 2;
  run();
  farm_.gain = 1;
  farm_.store->begin();
  farm_.planner->submit(farm_.shot_folder(), "", 0);
  ASSERT_EQ(farm_.state("encode"), JobState::Skipped);
  ASSERT_EQ(farm_.job("encode").key, old_encode);
  const Collected done = collect_garbage(options([&] {
    EXPECT_FALSE(has_artifact("encode", old_encode)) << "this test means the moment when it is in the trash";
    farm_.store->commit();
  }));
  EXPECT_TRUE(has_artifact("encode", old_encode));
  EXPECT_EQ(done.put_back.size(), 1U);
}

TEST_F(GarbageOfAShot, WhatAKilledCollectorLeftInTheTrashComesBack) {
  run();
  const std::string key = farm_.job("encode").key;
  fs::create_directories(store() / ".trash");
  fs::rename(store() / "encode" / key, store() / ".trash" / ("encode." + key));
  collect_garbage(options());
  EXPECT_TRUE(has_artifact("encode", key));
  EXPECT_FALSE(fs::exists(store() / ".trash"));
}

TEST_F(GarbageOfAShot, LeftOversOfDeadProcessesGoAndThoseOfTheLivingStay) {
  run();
  char host[256] = {};
  gethostname(host, sizeof host - 1);
  const fs::path mine = store() / ".tmp" / fmt::format("k.{}.{}.ab", host, getpid());
  const fs::path dead = store() / ".tmp" / fmt::format("k.{}.{}.ab", host, 2'000'000'000);
  const fs::path elsewhere = store() / ".tmp" / "k.other.studio.lan.1.ab";
  for (const auto& folder : {mine, dead, elsewhere}) fs::create_directories(folder / "frames");
  collect_garbage(options());
  EXPECT_TRUE(fs::exists(mine));
  EXPECT_FALSE(fs::exists(dead));
  EXPECT_FALSE(fs::exists(elsewhere));
}

TEST_F(GarbageOfAShot, LogsGoByAgeAndBySizeTheOldestFirst) {
  const fs::path logs = farm_.shot_folder() / ".vantage" / "logs" / "depth";
  run();
  for (const char* name : {"a.1.log", "b.1.log", "c.1.log"})
    write_file_atomically((fs::create_directories(logs), logs / name), "0123456789");
  const auto now = fs::file_time_type::clock::now();
  fs::last_write_time(logs / "a.1.log", now - std::chrono::hours(72));
  fs::last_write_time(logs / "b.1.log", now - std::chrono::hours(2));
  const std::int64_t now_ms = system_clock().wall_ms();
  const auto old_logs = [&](std::int64_t keep_ms, std::uintmax_t max_bytes) {
    std::vector<std::string> names;
    for (const Garbage& log :
         find_old_logs(farm_.shot_folder(), {},
                       {.now_ms = now_ms, .keep_ms = 0, .keep_logs_ms = keep_ms, .max_log_bytes = max_bytes}))
      if (log.path.parent_path() == logs) names.push_back(log.path.filename().string());
    return names;
  };
  EXPECT_EQ(old_logs(86'400'000, ~0ULL), std::vector<std::string>{"a.1.log"});
  EXPECT_EQ(old_logs(kFarFuture_ms, 20), std::vector<std::string>{"a.1.log"});
  EXPECT_TRUE(old_logs(kFarFuture_ms, 30).empty());
}

TEST_F(GarbageOfAShot, AFarmThatIsNotedInTheStoreAndCannotBeReadForbidsIt) {
  run();
  note_store_user(store(), "beef", "/no/such/farm");
  try {
    farms_of_store(store(), {state_dir()});
    FAIL() << "must not guess what the other farm needs";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("/no/such/farm"), std::string::npos) << e.what();
  }
}

TEST_F(GarbageOfAShot, FarmsNotedInTheStoreAreAsked) {
  run();
  note_store_user(store(), "f", state_dir());
  EXPECT_EQ(farms_of_store(store(), {}), std::vector<fs::path>{fs::canonical(state_dir())});
}

TEST_F(GarbageOfAShot, TwoCollectorsDoNotMeet) {
  run();
  std::string message;
  collect_garbage(options([&] {
    try {
      collect_garbage(options());
    } catch (const Error& e) {
      message = e.what();
    }
  }));
  EXPECT_NE(message.find("another 'vantage gc'"), std::string::npos) << message;
}

TEST_F(GarbageOfAShot, WaitsForTheTurnThatIsUnderWay) {
  const TurnLock scheduler(state_dir()), collector(state_dir());
  std::atomic<bool> waited{false};
  std::jthread waiter;
  {
    const auto turn = scheduler.turn();
    waiter = std::jthread([&] {
      collector.wait_for_turns_to_end();
      waited = true;
    });
    const TurnLock probe(state_dir());
    EXPECT_FALSE(waited);
  }
  waiter.join();
  EXPECT_TRUE(waited);
}

/// Random edits, reports, kills and collections in any order, also in the middle of each other.
class Interleaving {
 public:
  explicit Interleaving(unsigned seed) : random_(seed) { farm.submit(); }

  void step() {
    switch (pick(8)) {
      case 0:
        farm.gain = static_cast<double>(1 + pick(3));
        farm.sigma = 1.2 + static_cast<double>(pick(2));
        farm.num_edges = 1 + static_cast<int>(pick(4));
        farm.submit();
        break;
      case 1:
        collect();
        break;
      case 2:
        farm.kill(), farm.start();
        break;
      case 3:
        worker.restart();
        break;
      default:
        work();
    }
    farm.clock.now_ms += pick(500);
  }
  void work() {
    farm.sync(worker);
    if (!worker.held().empty()) worker.finish(worker.held().begin()->first);
  }
  void collect() {
    const fs::path store = store_of(farm.shot_folder());
    if (store.empty()) return;
    const bool in_a_turn = pick(2) == 0;
    if (in_a_turn) {
      farm.gain = static_cast<double>(1 + pick(3));
      farm.store->begin();
      farm.planner->submit(farm.shot_folder(), "", 0);
    }
    collect_garbage({.store = store,
                     .state_dirs = {farm.database().parent_path()},
                     .ages = {.now_ms = kFarFuture_ms, .keep_ms = 0, .keep_logs_ms = 0, .max_log_bytes = 0},
                     .between = [&] {
                       if (in_a_turn) farm.store->commit();
                       for (std::size_t i = pick(4); i > 0; --i) work();
                     }});
  }
  void expect_all_reachable() {
    for (Query q = farm.store->db().query("SELECT j.name, j.kind, j.key FROM job j JOIN shot s ON s.id = j.shot_id "
                                          "WHERE j.generation = s.generation AND j.state IN ('done', 'skipped')");
         q.step();)
      ASSERT_TRUE(read_valid_manifest(artifact_folder(store_of(farm.shot_folder()), q.text(1), q.text(2))))
          << q.text(0) << " lost its result " << q.text(2);
  }

  FakeFarm farm;
  FakeWorker worker{"w", 2};

 private:
  std::size_t pick(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_); }
  std::mt19937 random_;
};

TEST(Garbage, NoInterleavingLosesWhatAShotCanReach) {
  for (unsigned seed = 1; seed <= 15; ++seed) {
    SCOPED_TRACE(fmt::format("seed {}", seed));
    Interleaving story(seed);
    for (int i = 0; i < 60; ++i) {
      story.step();
      story.expect_all_reachable();
      if (testing::Test::HasFatalFailure()) return;
    }
    story.farm.submit();
    story.farm.run_to_end(story.worker);
    EXPECT_EQ(story.farm.store->shot(story.farm.shot)->state, "done");
    story.expect_all_reachable();
  }
}

}  // namespace
}  // namespace vantage
