#include "scheduler/upkeep/notifier.h"

#include <gtest/gtest.h>
#include <httplib.h>
#include <signal.h>

#include <atomic>
#include <chrono>
#include <mutex>

#include "scheduler/store/store.h"
#include "scheduler/upkeep/bounded_program.h"
#include "schema/base/files.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// Polls until it holds; false after ten seconds.
template <class Fn>
bool soon(const Fn& holds) {
  for (const auto until = std::chrono::steady_clock::now() + 10s; std::chrono::steady_clock::now() < until;) {
    if (holds()) return true;
    std::this_thread::sleep_for(5ms);
  }
  return false;
}

class Hooks : public testing::Test {
 protected:
  FarmConfig::Notify writes_to(const fs::path& file, std::vector<std::string> on) const {
    FarmConfig::Notify hook;
    hook.name = file.filename().string();
    hook.on = std::move(on);
    hook.command = {"sh", "-c", "cat >> '" + file.string() + "'"};
    return hook;
  }
  std::unique_ptr<Notifier> start(std::vector<FarmConfig::Notify> hooks) {
    auto notifier = std::make_unique<Notifier>(Notifier::Options{.state_dir = folder_.path(),
                                                                 .hooks = std::move(hooks),
                                                                 .on_trouble =
                                                                     [this](const std::string& sentence) {
                                                                       const std::lock_guard lock(mutex_);
                                                                       troubles_.push_back(sentence);
                                                                     },
                                                                 .look_every_ms = 5,
                                                                 .first_pause_ms = 5});
    return notifier;
  }
  bool knows(const std::string& hook) const { return fs::exists(folder_.path() / "notify" / (hook + ".json")); }
  std::string text_of(const fs::path& file) const { return fs::exists(file) ? read_file(file) : ""; }
  int count(const fs::path& file, const std::string& word) const {
    const std::string text = text_of(file);
    int num = 0;
    for (std::size_t at = 0; (at = text.find(word, at)) != std::string::npos; at += word.size()) ++num;
    return num;
  }
  std::vector<std::string> troubles() {
    const std::lock_guard lock(mutex_);
    return troubles_;
  }
  TemporaryFolder folder_;
  Store store_{folder_.path() / "farm.sqlite", system_clock()};
  std::mutex mutex_;
  std::vector<std::string> troubles_;
};

TEST_F(Hooks, EveryKindOfEventIsToldWithItsFacts) {
  const ShotRow shot = store_.submit_shot("/shots/dance", "dance", "", 0);
  store_.add_event(shot.id, std::nullopt, "", "state", "running");
  store_.add_event(shot.id, std::nullopt, "", "state", "done");
  store_.add_event(shot.id, std::nullopt, "", "state", "failed: no footage");
  store_.add_event(shot.id, JobId{7}, "", "state", "done");
  store_.add_event(shot.id, JobId{7}, "", "state", "quarantined: crashed 3 times");
  store_.add_event(std::nullopt, std::nullopt, "w1", "worker", "lost");
  store_.add_event(std::nullopt, std::nullopt, "w1", "decision", "w1 is set aside until it passes: x");
  store_.add_event(std::nullopt, std::nullopt, "", "warning", "disk_low: /store has 12 MB left");
  store_.add_event(std::nullopt, std::nullopt, "", "warning", "links: in the way");
  Sqlite db = open_farm_to_read(folder_.path());
  const Happenings found = happenings_after(db, 0);
  std::vector<std::string> events;
  for (const Happening& happening : found.list) events.push_back(happening.event);
  EXPECT_EQ(events, (std::vector<std::string>{"shot_done", "shot_failed", "job_quarantined", "worker_lost",
                                              "worker_set_aside", "disk_low"}));
  EXPECT_EQ(found.list[0].facts.at("shot").at("name"), "dance");
  EXPECT_EQ(found.list[1].facts.at("text"), "failed: no footage");
  EXPECT_EQ(found.list[3].facts.at("worker"), "w1");
  EXPECT_EQ(found.seen_to, last_event(db));
  EXPECT_TRUE(happenings_after(db, found.seen_to).list.empty());
}

TEST_F(Hooks, CommandGetsWhatItWaitsForAndNothingFromBeforeItWasThere) {
  store_.add_event(std::nullopt, std::nullopt, "old", "worker", "lost");
  const fs::path file = folder_.path() / "told";
  const auto notifier = start({writes_to(file, {"worker_lost"})});
  ASSERT_TRUE(soon([&] { return knows("told"); }));
  store_.add_event(std::nullopt, std::nullopt, "", "warning", "disk_low: x");
  store_.add_event(std::nullopt, std::nullopt, "new", "worker", "lost");
  ASSERT_TRUE(soon([&] { return count(file, "worker_lost") == 1; })) << text_of(file);
  EXPECT_EQ(Json::parse(text_of(file)).at("worker"), "new");
  EXPECT_EQ(count(file, "disk_low"), 0);
}

TEST_F(Hooks, WhatHappenedWhileNobodyListenedIsToldAfterARestart) {
  const fs::path file = folder_.path() / "told";
  start({writes_to(file, {"worker_lost"})});  // notes its place, then ends
  ASSERT_TRUE(knows("told") || soon([&] { return knows("told"); }));
  store_.add_event(std::nullopt, std::nullopt, "w", "worker", "lost");
  auto notifier = start({writes_to(file, {"worker_lost"})});
  ASSERT_TRUE(soon([&] { return count(file, "worker_lost") == 1; }));
  ASSERT_TRUE(soon([&] { return read_json(folder_.path() / "notify" / "told.json").at("told_to") == 1; }));
  notifier.reset();
  notifier = start({writes_to(file, {"worker_lost"})});
  store_.add_event(std::nullopt, std::nullopt, "w", "worker", "lost");
  ASSERT_TRUE(soon([&] { return count(file, "worker_lost") == 2; }));
  EXPECT_EQ(count(file, "worker_lost"), 2) << "what was taken is not told again";
}

TEST_F(Hooks, OneThatHangsIsEndedWithAllItsChildrenAndHoldsUpNoOther) {
  FarmConfig::Notify hangs = writes_to(folder_.path() / "hangs", {"worker_lost"});
  const fs::path pid_file = folder_.path() / "pid";
  hangs.command = {"sh", "-c", "sleep 1000 & echo $! > '" + pid_file.string() + "'; wait"};
  hangs.timeout_s = 1;
  hangs.tries = 1;
  const fs::path file = folder_.path() / "good";
  const auto notifier = start({hangs, writes_to(file, {"worker_lost"})});
  ASSERT_TRUE(soon([&] { return knows("hangs") && knows("good"); }));
  store_.add_event(std::nullopt, std::nullopt, "w", "worker", "lost");
  ASSERT_TRUE(soon([&] { return count(file, "worker_lost") == 1; }));
  ASSERT_TRUE(soon([&] { return !troubles().empty(); }));
  EXPECT_NE(troubles()[0].find("not done after 1 s"), std::string::npos) << troubles()[0];
  const pid_t child = std::stoi(read_file(pid_file));
  EXPECT_TRUE(soon([&] { return kill(child, 0) != 0; })) << "a child of the hook is still there";
}

TEST_F(Hooks, OneThatFailsIsTriedAgainThenSkippedAndShown) {
  FarmConfig::Notify fails = writes_to(folder_.path() / "fails", {"worker_lost"});
  const fs::path tries = folder_.path() / "tries";
  fails.command = {"sh", "-c", "echo x >> '" + tries.string() + "'; echo no network >&2; exit 3"};
  fails.tries = 3;
  const auto notifier = start({fails});
  ASSERT_TRUE(soon([&] { return knows("fails"); }));
  store_.add_event(std::nullopt, std::nullopt, "w", "worker", "lost");
  ASSERT_TRUE(soon([&] { return !troubles().empty(); }));
  EXPECT_EQ(count(tries, "x"), 3);
  EXPECT_NE(troubles()[0].find("exit code 3: no network"), std::string::npos) << troubles()[0];
}

TEST_F(Hooks, WebhookIsPostedAndRepeatedUntilTheServerTakesIt) {
  httplib::Server server;
  std::atomic<int> num_posts{0};
  std::mutex mutex;
  std::string body;
  server.Post("/hook", [&](const httplib::Request& request, httplib::Response& response) {
    const std::lock_guard lock(mutex);
    body = request.body;
    response.status = ++num_posts < 3 ? 503 : 200;
  });
  const int port = server.bind_to_any_port("127.0.0.1");
  std::jthread serving([&] { server.listen_after_bind(); });
  FarmConfig::Notify hook;
  hook.name = "web";
  hook.on = {"worker_lost"};
  hook.webhook = fmt::format("http://127.0.0.1:{}/hook", port);
  {
    const auto notifier = start({hook});
    ASSERT_TRUE(soon([&] { return knows("web"); }));
    store_.add_event(std::nullopt, std::nullopt, "w9", "worker", "lost");
    EXPECT_TRUE(soon([&] { return num_posts == 3; }));
    EXPECT_TRUE(soon([&] { return read_json(folder_.path() / "notify" / "web.json").at("told_to") == 1; }));
  }
  server.stop();
  EXPECT_EQ(num_posts, 3);
  EXPECT_EQ(Json::parse(body).at("worker"), "w9");
  EXPECT_TRUE(troubles().empty());
}

TEST(BoundedProgram, GivesInputAndTakesOutputAndExitCode) {
  const BoundedRun run = run_bounded({"sh", "-c", "cat; exit 4"}, "hello", 5000);
  EXPECT_EQ(run.output, "hello");
  EXPECT_EQ(run.exit_code, 4);
  EXPECT_EQ(run_bounded({"/no/such/program"}, "", 1000).exit_code, 127);
  EXPECT_TRUE(run_bounded({"sleep", "100"}, "", 20).timed_out);
}

TEST(BoundedProgram, TakesInputThatNobodyReads) {
  EXPECT_TRUE(run_bounded({"true"}, std::string(1'000'000, 'x'), 5000).ok());
}

}  // namespace
}  // namespace vantage
