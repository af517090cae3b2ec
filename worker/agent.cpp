#include "worker/agent.h"

#include <fmt/format.h>
#include <signal.h>
#include <string.h>

#include <algorithm>

#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr std::int64_t kTermToKillMs = 10'000;
constexpr std::int64_t kDefaultLeaseMs = 15'000;
constexpr std::size_t kMaxRecentlyFinished = 10'000;
/// Oldest go first: a scheduler that never acknowledges must not fill our memory. What was done is found in the store.
constexpr std::size_t kMaxUnacked = 2'000;
/// A need is an estimate; only what is far beyond it is killed, before the machine starts to swap.
constexpr std::int64_t kRamLimitFactor = 4, kRamLimitExtraMb = 4096;

bool holds(const std::vector<AttemptRef>& refs, const AttemptRef& ref) {
  return std::find(refs.begin(), refs.end(), ref) != refs.end();
}

std::int64_t ram_limit_mb(const Assignment& a) { return a.ram_mb * kRamLimitFactor + kRamLimitExtraMb; }

}  // namespace

Agent::Agent(AgentConfig config, std::vector<DoneAttempt> unacked)
    : config_(std::move(config)), done_unacked_(std::move(unacked)) {
  for (const DoneAttempt& d : done_unacked_) remember_finished(d.ref);
}

bool Agent::is_for_us_and_new(const WorkerOrders& o) const {
  return o.worker_id == config_.worker_id && o.incarnation == config_.incarnation &&
         std::pair(o.epoch, o.seq) >= std::pair(epoch_seen_, orders_seq_seen_);
}

Actions Agent::on_orders(const WorkerOrders& orders, std::int64_t now_ms) {
  Actions actions;
  if (!is_for_us_and_new(orders)) return actions;
  // The scheduler repeats itself until it sees that it was heard.
  actions.state_changed = std::pair(orders.epoch, orders.seq) != std::pair(epoch_seen_, orders_seq_seen_);
  epoch_seen_ = orders.epoch;
  orders_seq_seen_ = orders.seq;
  last_orders_ms_ = now_ms;
  lease_ms_ = orders.lease_ms > 0 ? orders.lease_ms : kDefaultLeaseMs;
  drain_ordered_ = orders.drain;
  take_acks(orders, actions);
  for (const AttemptRef& ref : orders.canceled) cancel(ref, now_ms, actions);
  if (!orders.reconciling) stop_absent(orders, now_ms, actions);
  take_assigned(orders, actions);
  start_queued(now_ms, actions);
  return actions;
}

void Agent::take_acks(const WorkerOrders& orders, Actions& actions) {
  const auto num_erased =
      std::erase_if(done_unacked_, [&](const DoneAttempt& d) { return holds(orders.acked, d.ref); });
  actions.state_changed |= num_erased > 0;
}

void Agent::stop_absent(const WorkerOrders& orders, std::int64_t now_ms, Actions& actions) {
  const auto is_absent = [&](const AttemptRef& ref) {
    return std::none_of(orders.assigned.begin(), orders.assigned.end(),
                        [&](const Assignment& a) { return a.ref == ref; });
  };
  actions.state_changed |= std::erase_if(queued_, [&](const Assignment& a) { return is_absent(a.ref); }) > 0;
  for (auto& [ref, running] : running_)
    if (is_absent(ref)) stop(running, Stop::Unwanted, now_ms, actions);
}

void Agent::cancel(const AttemptRef& ref, std::int64_t now_ms, Actions& actions) {
  const auto queued = std::find_if(queued_.begin(), queued_.end(), [&](const Assignment& a) { return a.ref == ref; });
  if (queued != queued_.end()) {
    queued_.erase(queued);
    finish({.ref = ref,
            .outcome = Outcome::Canceled,
            .error_kind = "",
            .message = "canceled before it started",
            .content = {}},
           actions);
  }
  if (const auto running = running_.find(ref); running != running_.end())
    stop(running->second, Stop::Canceled, now_ms, actions);
}

void Agent::take_assigned(const WorkerOrders& orders, Actions& actions) {
  if (drain_requested_) return;  // what is not listed in the report goes to another worker
  for (const Assignment& a : orders.assigned) {
    const bool is_queued =
        std::any_of(queued_.begin(), queued_.end(), [&](const Assignment& q) { return q.ref == a.ref; });
    const bool is_finished =
        std::find(recently_finished_.begin(), recently_finished_.end(), a.ref) != recently_finished_.end();
    if (is_queued || is_finished || running_.contains(a.ref) || holds(orders.canceled, a.ref) ||
        holds(orders.acked, a.ref))
      continue;
    queued_.push_back(a);
    actions.state_changed = true;
  }
}

bool Agent::has_room_for(const Assignment& next) const {
  if (running_.empty()) return true;  // a job larger than the machine runs alone
  std::int64_t cores = next.cores, ram_mb = next.ram_mb;
  for (const auto& [ref, running] : running_) {
    cores += running.assignment.cores;
    ram_mb += running.assignment.ram_mb;
  }
  return std::ssize(running_) < config_.slots && cores <= config_.cores && ram_mb <= config_.ram_mb;
}

bool Agent::may_start(std::int64_t now_ms) const {
  return !drain_ordered_ && !drain_requested_ && last_orders_ms_ >= 0 && now_ms - last_orders_ms_ <= lease_ms_;
}

void Agent::start_queued(std::int64_t now_ms, Actions& actions) {
  while (may_start(now_ms) && !queued_.empty() && has_room_for(queued_.front())) {
    const Assignment next = queued_.front();
    queued_.pop_front();
    running_[next.ref] = {.assignment = next, .figures = {.ref = next.ref, .phase = "starting"}, .started_ms = now_ms};
    actions.start.push_back(next);
    actions.state_changed = true;
  }
}

void Agent::stop(Running& running, Stop why, std::int64_t now_ms, Actions& actions) {
  if (running.stop != Stop::None) return;
  running.stop = why;
  running.kill_at_ms = now_ms + kTermToKillMs;
  actions.signals.push_back({running.assignment.ref, SIGTERM});
  actions.state_changed = true;
}

Actions Agent::on_tick(std::int64_t now_ms) {
  Actions actions;
  for (auto& [ref, running] : running_) {
    const std::int64_t timeout_ms = std::int64_t{running.assignment.timeout_s} * 1000;
    if (timeout_ms > 0 && now_ms - running.started_ms >= timeout_ms) stop(running, Stop::TimedOut, now_ms, actions);
    if (running.figures.rss_mb > ram_limit_mb(running.assignment)) stop(running, Stop::TooMuchMemory, now_ms, actions);
    if (running.stop != Stop::None && now_ms >= running.kill_at_ms) actions.signals.push_back({ref, SIGKILL});
  }
  start_queued(now_ms, actions);
  return actions;
}

Actions Agent::on_progress(const RunningAttempt& seen) {
  Actions actions;
  const auto found = running_.find(seen.ref);
  if (found == running_.end()) return actions;
  RunningAttempt& known = found->second.figures;
  actions.state_changed = known.phase != seen.phase || known.progress != seen.progress;
  known = seen;
  return actions;
}

Actions Agent::on_drain_request() {
  drain_requested_ = true;
  queued_.clear();
  return {.start = {}, .signals = {}, .state_changed = true};
}

Actions Agent::on_quit_request(std::int64_t now_ms) {
  Actions actions = on_drain_request();
  for (auto& [ref, running] : running_) {
    stop(running, Stop::Unwanted, now_ms, actions);
    actions.signals.push_back({ref, SIGKILL});
  }
  return actions;
}

DoneAttempt Agent::outcome_of(const ChildExit& exit, const Running& running) const {
  DoneAttempt d = exit.outcome;
  d.ref = exit.ref;
  d.exit_code = exit.exit_code;
  d.signal = exit.signal;
  d.wall_ms = exit.wall_ms;
  d.peak_rss_mb = exit.peak_rss_mb;
  // A committed artifact is done, whatever we wished meanwhile; so is an error that the child told itself.
  if (exit.has_outcome && (d.outcome == Outcome::Done || running.stop == Stop::None)) return d;
  const auto failed = [&d](Outcome outcome, ErrorKind kind, std::string message) {
    d.outcome = outcome;
    d.error_kind = to_string(kind);
    d.message = std::move(message);
    return d;
  };
  switch (running.stop) {
    case Stop::Canceled:
      return failed(Outcome::Canceled, ErrorKind::Transient, "canceled");
    case Stop::Unwanted:
      return failed(Outcome::Canceled, ErrorKind::Transient, "stopped: not assigned to this worker any more");
    case Stop::TimedOut:
      return failed(Outcome::Failed, ErrorKind::Resource,
                    fmt::format("ran longer than its limit of {} s", running.assignment.timeout_s));
    case Stop::TooMuchMemory:
      return failed(
          Outcome::Failed, ErrorKind::Resource,
          fmt::format("used {} MB of memory, limit {} MB", running.figures.rss_mb, ram_limit_mb(running.assignment)));
    case Stop::None:
      break;
  }
  if (exit.signal == SIGKILL && exit.out_of_memory)
    return failed(Outcome::Failed, ErrorKind::Resource,
                  fmt::format("killed by the kernel: machine out of memory (peak {} MB)", exit.peak_rss_mb));
  if (exit.signal != 0)
    return failed(Outcome::Crashed, ErrorKind::Crash,
                  fmt::format("killed by signal {} ({})", exit.signal, strsignal(exit.signal)));
  return failed(Outcome::Crashed, ErrorKind::Crash,
                fmt::format("exited with status {} without a result", exit.exit_code));
}

Actions Agent::on_child_exit(const ChildExit& exit, std::int64_t now_ms) {
  Actions actions;
  const auto found = running_.find(exit.ref);
  if (found == running_.end()) return actions;
  DoneAttempt done = outcome_of(exit, found->second);
  running_.erase(found);
  finish(std::move(done), actions);
  start_queued(now_ms, actions);
  return actions;
}

void Agent::finish(DoneAttempt done, Actions& actions) {
  remember_finished(done.ref);
  if (done_unacked_.size() >= kMaxUnacked) done_unacked_.erase(done_unacked_.begin());
  done_unacked_.push_back(std::move(done));
  actions.state_changed = true;
  actions.outbox_grew = true;
}

void Agent::remember_finished(const AttemptRef& ref) {
  recently_finished_.push_back(ref);
  if (recently_finished_.size() > kMaxRecentlyFinished) recently_finished_.pop_front();
}

WorkerReport Agent::report(const MachineState& machine) {
  WorkerReport r;
  r.worker_id = config_.worker_id;
  r.incarnation = config_.incarnation;
  r.seq = ++report_seq_;
  r.host = config_.host;
  r.pool = config_.pool;
  r.slots = config_.slots;
  r.cores = config_.cores;
  r.ram_mb = config_.ram_mb;
  r.free_disk_mb = machine.free_disk_mb;
  r.wall_ms = machine.wall_ms;
  r.num_dropped = machine.num_dropped;
  r.trouble = machine.trouble;
  r.tags = config_.tags;
  r.kinds = config_.kinds;
  r.build = config_.build;
  r.draining = drain_ordered_ || drain_requested_;
  r.epoch_seen = epoch_seen_;
  r.orders_seq_seen = orders_seq_seen_;
  for (const auto& [ref, running] : running_) r.running.push_back(running.figures);
  for (const Assignment& a : queued_) r.running.push_back({a.ref, "queued", 0, 0});
  r.done_unacked = done_unacked_;
  return r;
}

}  // namespace vantage
