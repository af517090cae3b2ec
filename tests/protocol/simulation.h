#pragma once
/// A farm in simulated time: the real dispatcher, planner, database, codec and agents; a bus, clocks, disks and
/// processes that a schedule governs.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/protocol/checks.h"
#include "tests/protocol/network.h"
#include "tests/protocol/schedule.h"
#include "tests/protocol/sim_worker.h"
#include "tests/support/fake_farm.h"

namespace vantage {

/// What a schedule came to.
struct RunResult {
  std::string violation;           ///< empty: every promise was kept
  std::vector<std::string> trace;  ///< what happened, one line each
  int num_killed = 0, num_jobs = 0, num_attempts = 0;
  std::int64_t num_dropped = 0;  ///< datagrams that the scheduler did not take
  std::int64_t simulated_ms = 0;
};

RunResult run_schedule(const Schedule& schedule);
/// The same violation with as few faults as can be found by leaving them out one by one.
Schedule shrink(Schedule schedule);

/// The scheduler's process.
class SimScheduler final : public Bus {
 public:
  enum class Death { AtOnce, InTransaction, BeforeCommit, BeforeSending, WhileSending };
  static constexpr int kNumDeaths = 5;

  SimScheduler(World& world, Network& network, Ledger& ledger, const Schedule& schedule, const Farm& farm);

  void start();
  void kill(Death where, std::int64_t down_ms);
  void stall(std::int64_t for_ms) { stalled_until_ms_ = std::max(stalled_until_ms_, world_.now_ms() + for_ms); }
  /// Within the next turn. What a person cannot ask now is refused and changes nothing.
  void command(const Command& command);
  void resubmit();

  bool is_up() const { return farm_.store != nullptr; }
  FakeFarm& farm() { return farm_; }
  Checks& checks() { return *checks_; }
  int num_killed() const { return num_killed_; }
  std::int64_t num_dropped() const { return num_dropped_; }

  void send(const WorkerOrders& orders) override;
  void send(const SchedulerHello& hello) override;

 private:
  struct Died {};
  void hear(const Delivery& delivery);
  void wake();
  void turn();
  void die_if(Death here);
  void say(const Message& message, const std::string& to);

  World& world_;
  Network& network_;
  Farm identity_;
  int num_workers_;
  FakeFarm farm_;
  std::optional<Checks> checks_;
  std::optional<Decoder> decoder_;
  std::vector<WorkerReport> reports_;
  std::vector<Command> commands_;
  std::optional<Death> death_;
  bool resubmit_ = false, turn_is_due_ = false;
  std::int64_t stalled_until_ms_ = 0, down_ms_ = 0, num_dropped_ = 0, seq_ = 0, last_epoch_ = 0;
  int life_ = 0, num_killed_ = 0, num_sent_in_turn_ = 0;
};

}  // namespace vantage
