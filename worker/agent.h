#pragma once
/// What a worker decides, as plain functions over values: no clock, no process, no message in here.
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "schema/messages/protocol.h"

namespace vantage {

struct AgentConfig {
  std::string worker_id;
  std::int64_t incarnation = 0;
  std::string host, pool;
  std::int32_t slots = 1, cores = 1, ram_mb = 0;
  std::vector<std::string> tags = {}, kinds = {};
  std::int64_t stuck_after_ms = 900'000;  ///< a child without progress and processor time for that long hangs
  std::string build = {};
};

/// What the edge sees of the machine when a report goes out.
struct MachineState {
  std::int64_t now_ms = 0;  ///< monotonic
  std::int32_t free_disk_mb = 0;
  std::int64_t wall_ms = 0;
  std::int64_t num_dropped = 0;  ///< messages
};

/// How a child ended, as the edge saw it.
struct ChildExit {
  AttemptRef ref;
  std::int32_t exit_code = 0, signal = 0;
  std::int64_t wall_ms = 0;
  std::int32_t peak_rss_mb = 0;
  bool out_of_memory = false;  ///< the kernel killed something for lack of memory while it ran
  bool has_outcome = false;    ///< it wrote one: `outcome` holds what it says
  DoneAttempt outcome;
};

struct SignalChild {
  AttemptRef ref;
  int signal = 0;  ///< to its whole process group
};

/// What the edge must do now. Starts that fail come back as on_child_exit.
struct Actions {
  std::vector<Assignment> start;
  std::vector<SignalChild> signals;
  bool state_changed = false;  ///< report soon
  bool outbox_grew = false;    ///< make done_unacked() durable
  std::string replaced_by;     ///< host of another worker with this identity, which came later: stop
};

/// Holds the attempts that the scheduler assigned: queued, then running, then done until acknowledged. Level-triggered:
/// orders are the whole wish, the report is the whole state. One thread; times are monotonic milliseconds.
class Agent {
 public:
  /// unacked: what an earlier incarnation finished and nobody acknowledged.
  Agent(AgentConfig config, std::vector<DoneAttempt> unacked);

  /// Orders for another incarnation, or older than what was seen, change nothing.
  Actions on_orders(const WorkerOrders& orders, std::int64_t now_ms);
  Actions on_child_exit(const ChildExit& exit, std::int64_t now_ms);
  /// Time-outs, memory limits, kills that follow a polite request; starts nothing once the lease has run out.
  /// free_ram_mb: of the machine.
  Actions on_tick(std::int64_t now_ms, std::int64_t free_ram_mb);
  /// Progress, memory and processor time of a running child.
  Actions on_progress(const RunningAttempt& seen, std::int64_t cpu_ticks, std::int64_t now_ms);
  /// Attempts that ended without their fault or result: no longer reported, so that the scheduler gives them out again.
  Actions on_lost(const std::vector<AttemptRef>& refs, std::int64_t now_ms);
  /// Why nothing can be started now (no disk space …); "" = it can.
  Actions on_trouble(const std::string& trouble, std::int64_t now_ms);
  /// Finish what runs, start nothing more; cannot be taken back.
  Actions on_drain_request();
  /// Stop everything now.
  Actions on_quit_request(std::int64_t now_ms);

  WorkerReport report(const MachineState& machine);
  const std::vector<DoneAttempt>& done_unacked() const { return done_unacked_; }
  bool has_running() const { return !running_.empty(); }
  bool has_seen_orders() const { return has_seen_orders_; }
  /// Draining by request, nothing runs any more.
  bool is_drained() const { return drain_requested_ && running_.empty(); }

 private:
  enum class Stop { None, Canceled, Unwanted, TimedOut, Stuck, TooMuchMemory, MachineFull };
  struct Running {
    Assignment assignment;
    RunningAttempt figures;
    std::int64_t started_ms = 0;
    std::int64_t active_ms = 0;  ///< last change of progress or processor time
    std::int64_t cpu_ticks = 0;
    Stop stop = Stop::None;
    std::int64_t kill_at_ms = 0;  ///< after a TERM
  };

  bool is_for_us_and_new(const WorkerOrders& orders) const;
  void take_acks(const WorkerOrders& orders, Actions& actions);
  void take_assigned(const WorkerOrders& orders, Actions& actions);
  void stop_absent(const WorkerOrders& orders, std::int64_t now_ms, Actions& actions);
  void cancel(const AttemptRef& ref, std::int64_t now_ms, Actions& actions);
  void stop(Running& running, Stop why, std::int64_t now_ms, Actions& actions);
  void start_queued(std::int64_t now_ms, Actions& actions);
  void stop_beyond_limits(Running& running, std::int64_t now_ms, Actions& actions);
  void relieve_machine(std::int64_t now_ms, std::int64_t free_ram_mb, Actions& actions);
  void renew_lease(const WorkerOrders& orders);
  bool has_room_for(const Assignment& next) const;
  bool may_start(std::int64_t now_ms) const;
  DoneAttempt outcome_of(const ChildExit& exit, const Running& running) const;
  void finish(DoneAttempt done, Actions& actions);
  void remember_finished(const AttemptRef& ref);
  void forget_running(std::map<AttemptRef, Running>::iterator running);

  AgentConfig config_;
  std::deque<Assignment> queued_;
  std::set<AttemptRef> queued_refs_;
  std::map<AttemptRef, Running> running_;
  std::int64_t used_cores_ = 0, used_ram_mb_ = 0;  ///< of running_
  std::vector<DoneAttempt> done_unacked_;
  std::set<AttemptRef> finished_;  ///< never to be started again, whatever late orders say
  std::deque<AttemptRef> finished_in_order_;
  std::string trouble_;
  std::int64_t epoch_seen_ = 0, orders_seq_seen_ = 0;
  bool has_seen_orders_ = false;
  std::deque<std::pair<std::int64_t, std::int64_t>> sent_;  ///< seq and time of reports that no orders answered yet
  std::int64_t lease_until_ms_ = 0;
  std::int64_t report_seq_ = 0;
  bool drain_ordered_ = false, drain_requested_ = false;
};

}  // namespace vantage
