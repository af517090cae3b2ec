#pragma once
/// A worker machine: the real Agent and the real codec; its disk, processes and jobs are simulated.
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "schema/formats/job_file.h"
#include "schema/messages/codec.h"
#include "tests/protocol/network.h"
#include "tests/protocol/world.h"
#include "worker/agent.h"

namespace vantage {

/// What really happened, to be held against what the scheduler believes.
struct Ledger {
  std::map<AttemptRef, std::set<Outcome>> ends;  ///< as the workers saw them
  std::set<AttemptRef> started;                  ///< a process of its own was started for it
  std::map<std::string, int> num_made;           ///< results computed, by key
};

class SimWorker {
 public:
  /// Where the process dies when it comes there next.
  enum class Death { AtOnce, BeforeReport, BeforeOutbox, AfterOutbox, AfterStart };
  static constexpr int kNumDeaths = 5;
  struct Config {
    std::string id;
    int slots = 1;
    Fates fates;
    Farm farm;
    std::filesystem::path elsewhere;                 ///< for results that the scheduler's storage does not show yet
    std::function<void(const AttemptRef&)> on_stop;  ///< it stops a job that was not too slow
  };

  SimWorker(World& world, Network& network, Ledger& ledger, Config config);

  void start();
  /// kill -9, its jobs' processes with it; again after down_ms.
  void kill(Death where, std::int64_t down_ms);
  void stall(std::int64_t for_ms);
  /// Power off, for good.
  void lose();
  bool is_lost() const { return is_lost_; }

  const std::string& id() const { return config_.id; }
  /// Alive, nothing runs, nothing is queued, nothing waits for an acknowledgement.
  bool is_idle() const;
  std::string what_it_does() const;

 private:
  struct Child {
    Assignment assignment;
    JobFile job;
    std::uint64_t serial = 0;
    std::int64_t started_ms = 0;
    bool stubborn = false, has_made_it = false;
    std::string content;
  };
  /// All that a kill takes away.
  struct Process {
    Process(const AgentConfig& config, std::vector<DoneAttempt> outbox, const Farm& farm)
        : agent(config, std::move(outbox)), decoder(farm) {}
    Agent agent;
    Decoder decoder;
    std::int64_t seq = 0, last_report_ms = -1'000'000, next_tick_ms = 0;
    bool changed = true, outbox_grew = false;
    std::vector<WorkerOrders> inbox;
    std::vector<ChildExit> exits;
    std::map<AttemptRef, Child> children;
  };
  struct Died {};

  void hear(const Delivery& delivery);
  void wake();
  void turn();
  void apply(const Actions& actions);
  void start_child(const Assignment& assignment);
  void run_inside(const Assignment& assignment);
  void make(Child& child);
  void end_child(const AttemptRef& ref, int signal, std::optional<DoneAttempt> outcome);
  void signal_child(const SignalChild& signal);
  void report_when_due();
  void save_outbox();
  void die_if(Death here);
  /// Runs fn later if this life lasts until then.
  void later(std::int64_t delay_ms, std::function<void()> fn);

  World& world_;
  Network& network_;
  Ledger& ledger_;
  Config config_;
  // Its disk:
  std::int64_t incarnation_ = 0;
  std::vector<DoneAttempt> outbox_;
  // Its process:
  std::unique_ptr<Process> process_;
  std::int64_t stalled_until_ms_ = 0, down_ms_ = 0;
  bool is_lost_ = false;
  std::optional<Death> death_;
  static std::uint64_t hash_of(const std::string& text);
  std::uint64_t num_children_ = 0;
};

}  // namespace vantage
