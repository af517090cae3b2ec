#pragma once
/// Who runs what: pure decisions on reports, on the passing of time and on people's commands. Reads no clock, sends
/// nothing before its writes are committed. The scheduler's thread only.
///
///   store.begin(); dispatcher.on_report(…); dispatcher.on_tick(…); store.commit(); dispatcher.flush(bus, …);
#include <functional>
#include <map>
#include <string>
#include <unordered_map>

#include "scheduler/dispatch/bus.h"
#include "scheduler/dispatch/command.h"
#include "scheduler/dispatch/ready_jobs.h"
#include "scheduler/dispatch/retry.h"
#include "scheduler/dispatch/storage_watch.h"
#include "scheduler/dispatch/worker_table.h"
#include "scheduler/plan/planner.h"
#include "scheduler/store/store.h"

namespace vantage {

class Dispatcher {
 public:
  struct Options {
    std::string farm_id;
    int lease_ms = 15000;
    std::function<std::uint64_t()> random;  ///< 64 random bits: tokens, jitter
  };
  Dispatcher(Store& store, Planner& planner, Options options);

  /// After every start, and after a transaction that was rolled back, within a new one: forgets all, begins a new
  /// epoch; what was out with workers waits for their reports for the time of a lease, while ready work goes on.
  void recover(std::int64_t now_ms);

  /// A report that was made before the worker heard of this epoch (it may be an old one, played again) is only answered
  /// with orders that stop nothing; what it says counts when the worker says it again.
  void on_report(const WorkerReport& report, std::int64_t now_ms);
  /// We ourselves did nothing for a while (a long transaction, a stopped process): nobody's lease ran meanwhile.
  void on_stall(std::int64_t stall_ms);
  /// Leases, lost workers, then claims.
  void on_tick(std::int64_t now_ms);
  /// Throws Error(BadInput) for a target that is not there; the caller must then undo what was written.
  CommandResult on_command(const Command& command);

  /// Why nothing is handed out although there is work, in one line; empty when all is well.
  const std::string& trouble() const { return trouble_; }
  std::int64_t num_claimed() const { return num_claimed_; }

  /// After the commit: sends what changed, and repeats what was not confirmed. http_address goes out with the hello.
  void flush(Bus& bus, const std::string& http_address, std::int64_t now_ms);

  std::int64_t epoch() const { return epoch_; }
  int num_live_workers() const;

 private:
  /// What a report lists, for look-ups.
  struct Listed {
    explicit Listed(const WorkerReport& report);
    std::vector<AttemptRef> running, done;  ///< sorted
  };
  void expect_back(const AttemptRow& attempt, std::int64_t now_ms);
  enum class Spec { Write, IsThere };
  Held held_of(const JobRow& job, const AttemptRef& ref, const std::string& log_path, Spec spec, std::int64_t now_ms);
  void give_spec(const JobRow& job, Spec spec, Assignment& assignment);
  void greet(const WorkerReport& report);
  void note_worker(LiveWorker& worker, const WorkerReport& report, std::int64_t now_ms);
  void on_running(LiveWorker& worker, const RunningAttempt& running, std::int64_t now_ms);
  void readopt_or_cancel(LiveWorker& worker, const RunningAttempt& running, std::int64_t now_ms);
  void on_done(LiveWorker& worker, const DoneAttempt& done, std::int64_t now_ms);
  bool accept(LiveWorker& worker, const AttemptRow& attempt, const DoneAttempt& done, std::int64_t now_ms);
  void fail(LiveWorker& worker, const AttemptRow& attempt, const DoneAttempt& done, std::int64_t now_ms);
  void make_damaged_input_again(const JobRow& job, const DoneAttempt& done);
  void note_decision(const JobRow& job, const RetryDecision& decision);
  void drop_forgotten(LiveWorker& worker, const Listed& listed, bool reborn, std::int64_t now_ms);
  void acknowledge(LiveWorker& worker, const AttemptRef& ref);
  void forget_settled(LiveWorker& worker, const Listed& listed);

  // Trust and hours.
  void recall_standing(const std::string& id, LiveWorker& worker);
  void write_standing(const LiveWorker& worker);
  void note_failure(LiveWorker& worker, const JobRow& job, const DoneAttempt& done);
  void note_success(LiveWorker& worker, JobId job, const std::string& kind);
  void set_aside(LiveWorker& worker, const std::string& why);
  void forgive(LiveWorker& worker);
  void start_selftest(LiveWorker& worker, std::int64_t now_ms);
  /// error: empty when it passed.
  void end_selftest(LiveWorker& worker, const JobRow& job, const std::string& error);
  void test_doubted(std::int64_t now_ms);
  void look_at_the_clock();
  void show_state(const LiveWorker& worker);
  bool another_could(const LiveWorker& self, const Wanted& wanted) const;
  bool avoids(const LiveWorker& worker, const Wanted& wanted) const;

  void expire_leases(std::int64_t now_ms);
  void lose(LiveWorker& worker, const AttemptRef& ref, const std::string& why);
  void stop_revoked();

  struct Room;
  enum class Claim { Run, Prefetch };
  void claim_for_all(std::int64_t now_ms);
  std::vector<Room> rooms();
  bool claim_one(Room& room, Claim claim, ReadyJobs& ready, std::int64_t now_ms);
  bool can_be_stored(const ReadyClass& ready, std::int64_t now_ms);
  bool suits(const Room& room, Claim claim, const ReadyClass& ready) const;
  bool suits(const LiveWorker& worker, const JobRow& job) const;
  void reserve_for(const ReadyClass& lone, std::vector<Room>& rooms) const;
  bool hand_out(LiveWorker& worker, const JobRow& job, std::int64_t now_ms);
  int num_ahead_per_slot(const std::string& kind) const;

  struct Target;
  Target target_of(const Command& command);
  std::vector<JobId> jobs_of(const Target& target, std::initializer_list<JobState> states);
  CommandResult result_of(const std::vector<JobId>& jobs, std::string text);
  CommandResult on_job_command(const Command& command);
  CommandResult pause(const Target& target, bool dry_run);
  CommandResult resume(const Target& target, bool dry_run);
  CommandResult cancel(const Target& target, bool dry_run);
  CommandResult retry(const Target& target, bool dry_run);
  CommandResult rerun(const Target& target, bool dry_run);
  CommandResult set_priority(const Target& target, int priority, bool dry_run);
  CommandResult on_worker_command(const Command& command);
  std::string effect_of(const Command& command, const LiveWorker& worker) const;

  WorkerOrders orders_for(const WorkerReport& report, std::int64_t now_ms);
  void send_orders(LiveWorker& worker, Bus& bus, std::int64_t now_ms);
  double jitter();

  Store& store_;
  Planner& planner_;
  Options options_;
  StorageWatch storage_;
  std::map<ShotId, std::string> told_trouble_;  ///< of its storage
  std::int64_t epoch_ = 0, reconcile_until_ms_ = 0, next_hello_ms_ = 0;
  std::int64_t last_seq_ = 0;                     ///< of orders to anybody
  std::map<std::string, WorkerReport> to_greet_;  ///< by worker
  std::map<std::string, LiveWorker> workers_;
  std::int64_t minute_seen_ = -1;  ///< of the wall clock, by which hours were looked at last
  // Claims are looked for when something may have changed, and now and then.
  bool may_claim_ = true;
  std::string trouble_;
  std::int64_t num_claimed_ = 0;
  std::int64_t num_woken_seen_ = -1, next_claim_ms_ = 0;
  std::unordered_map<std::string, double> mean_wall_ms_;  ///< by kind, of attempts since the start
};

/// A job of the scheduler's own, which checks a worker.
bool is_selftest(const std::string& kind);

}  // namespace vantage
