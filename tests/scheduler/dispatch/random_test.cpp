/// Loss, repetition, reordering, kills and restarts in a seeded random order: whatever happens, the shot ends done, the
/// database stays sound, and no result that the farm has taken is made again.
#include <gtest/gtest.h>

#include <random>

#include "tests/support/fake_farm.h"

namespace vantage {
namespace {

class Storm {
 public:
  explicit Storm(unsigned seed) : random_(seed) {
    farm.num_edges = 6;
    workers_.emplace_back("w0", 2);
    workers_.emplace_back("w1", 1);
    workers_.emplace_back("w2", 2);
    farm.submit();
  }

  void step() {
    farm.clock.now_ms += pick(400);
    FakeWorker& worker = workers_[pick(workers_.size())];
    switch (pick(20)) {
      case 0:
        worker.restart();
        break;
      case 1:
        farm.kill();
        farm.start();
        break;
      case 2:
        farm.clock.now_ms += 4'000;
        break;
      case 3:
        crash_something(worker);
        break;
      case 4:
      case 5:
      case 6:
        finish_something(worker);
        break;
      case 7:
      case 8:
      case 9:
        in_flight_.push_back(worker.report());
        break;  // sent now, arrives some time
      case 10:
      case 11:
      case 12:
      case 13:
        deliver_report();
        break;
      case 14:
        farm.turn();
        break;
      default:
        deliver_orders(worker);
    }
    check_soundness();
  }
  /// Calm weather: everything arrives.
  void settle() {
    for (int i = 0; i < 400 && farm.store->shot(farm.shot)->state == "running"; ++i) {
      farm.clock.now_ms += 500;
      for (FakeWorker& worker : workers_) {
        farm.sync(worker);
        finish_something(worker);
      }
    }
  }

  FakeFarm farm;

 private:
  std::size_t pick(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_); }

  void finish_something(FakeWorker& worker) {
    if (worker.held().empty()) return;
    const auto held = std::next(worker.held().begin(), static_cast<std::ptrdiff_t>(pick(worker.held().size())));
    const JobId job{held->first.job_id};
    const JobRow before = *farm.store->job(job);
    EXPECT_FALSE(is_good(before.state) && before.num_attempts >= held->first.number && taken_.contains(before.key) &&
                 held->first.number > taken_.at(before.key))
        << before.name << ": handed out again after its result was taken";
    worker.finish(held->first);
  }
  void crash_something(FakeWorker& worker) {
    if (worker.held().empty() || num_crashes_ >= 2) return;  // three of one job would rightly end it
    ++num_crashes_;
    worker.fail(worker.held().begin()->first, Outcome::Crashed, ErrorKind::Crash, "signal 9");
  }
  void deliver_report() {
    if (in_flight_.empty()) return;
    const std::size_t i = pick(in_flight_.size());
    if (pick(4) > 0) farm.report(in_flight_[i]);
    if (pick(3) > 0) in_flight_.erase(in_flight_.begin() + static_cast<std::ptrdiff_t>(i));  // else it comes once more
  }
  void deliver_orders(FakeWorker& worker) {
    const auto& sent = farm.bus.sent[worker.id()];
    if (!sent.empty()) worker.take(pick(3) > 0 ? sent.back() : sent[pick(sent.size())]);
  }

  void check_soundness() {
    Sqlite& db = farm.store->db();
    EXPECT_EQ(db.integer_or(-1,
                            "SELECT count(*) FROM job WHERE num_unmet <> (SELECT count(*) FROM dependency d JOIN job n "
                            "ON n.id = d.needs_id WHERE d.job_id = job.id AND n.state NOT IN ('done', 'skipped'))"),
              0)
        << "a count of unmet needs is wrong";
    EXPECT_EQ(db.integer_or(-1,
                            "SELECT count(*) FROM job WHERE (state IN ('leased', 'running', 'reconnect')) <> "
                            "(SELECT count(*) FROM attempt WHERE job_id = job.id AND state <> 'ended')"),
              0)
        << "active jobs have one open attempt, others none";
    EXPECT_EQ(db.integer_or(-1, "SELECT count(*) FROM job WHERE state = 'blocked' AND num_unmet = 0"), 0);
    for (Query q = db.query("SELECT key, num_attempts FROM job WHERE state = 'done'"); q.step();) {
      const int num_attempts = static_cast<int>(q.integer(1));
      const auto [entry, is_new] = taken_.try_emplace(q.text(0), num_attempts);
      EXPECT_EQ(entry->second, num_attempts) << "a finished job was handed out again";
    }
  }

  std::mt19937 random_;
  std::vector<FakeWorker> workers_;
  std::vector<WorkerReport> in_flight_;
  std::map<std::string, int> taken_;  ///< attempts at the time a key was done
  int num_crashes_ = 0;
};

TEST(RandomInterleaving, EndsDoneWhateverTheBusAndTheMachinesDo) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Storm storm(seed);
    for (int i = 0; i < 250; ++i) storm.step();
    storm.settle();
    EXPECT_EQ(storm.farm.store->shot(storm.farm.shot)->state, "done");
    if (testing::Test::HasFailure()) break;
  }
}

}  // namespace
}  // namespace vantage
