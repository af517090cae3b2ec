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
constexpr std::size_t kMaxSentRemembered = 1'000;
/// A need is an estimate: half as much again, or 500 MB for the small ones, is forgiven.
constexpr std::int64_t kRamForgivenMb = 500;
/// Below this, whoever has most beyond its reservation goes, before the kernel chooses.
constexpr std::int64_t kMachineFullMb = 200;

std::int64_t ram_limit_mb(const Assignment& a) {
  return std::max<std::int64_t>(a.ram_mb + a.ram_mb / 2, a.ram_mb + kRamForgivenMb);
}

std::set<AttemptRef> set_of(const std::vector<AttemptRef>& refs) { return {refs.begin(), refs.end()}; }

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
  if (orders.worker_id == config_.worker_id && orders.incarnation > config_.incarnation)
    actions.replaced_by = orders.host;
  if (!is_for_us_and_new(orders)) return actions;
  // The scheduler repeats itself until it sees that it was heard.
  actions.state_changed = std::pair(orders.epoch, orders.seq) != std::pair(epoch_seen_, orders_seq_seen_);
  epoch_seen_ = orders.epoch;
  orders_seq_seen_ = orders.seq;
  has_seen_orders_ = true;
  renew_lease(orders);
  drain_ordered_ = orders.drain;
  take_acks(orders, actions);
  for (const AttemptRef& ref : orders.canceled) cancel(ref, now_ms, actions);
  if (!orders.reconciling) stop_absent(orders, now_ms, actions);
  take_assigned(orders, actions);
  start_queued(now_ms, actions);
  return actions;
}

/// The scheduler's lease began when it got the report that it names, so ours, which begins when that was sent, ends
/// before the scheduler's does. A worker that was stopped for a while holds none, whatever orders waited for it.
void Agent::renew_lease(const WorkerOrders& orders) {
  const std::int64_t lease_ms = orders.lease_ms > 0 ? orders.lease_ms : kDefaultLeaseMs;
  while (!sent_.empty() && sent_.front().first <= orders.report_seq_seen) {
    lease_until_ms_ = sent_.front().second + lease_ms;
    sent_.pop_front();
  }
}

void Agent::take_acks(const WorkerOrders& orders, Actions& actions) {
  if (done_unacked_.empty() || orders.acked.empty()) return;
  const auto acked = set_of(orders.acked);
  const auto num_erased = std::erase_if(done_unacked_, [&](const DoneAttempt& d) { return acked.contains(d.ref); });
  actions.state_changed |= num_erased > 0;
}

void Agent::stop_absent(const WorkerOrders& orders, std::int64_t now_ms, Actions& actions) {
  std::set<AttemptRef> assigned;
  for (const Assignment& a : orders.assigned) assigned.insert(a.ref);
  actions.state_changed |= std::erase_if(queued_, [&](const Assignment& a) { return !assigned.contains(a.ref); }) > 0;
  std::erase_if(queued_refs_, [&](const AttemptRef& ref) { return !assigned.contains(ref); });
  for (auto& [ref, running] : running_)
    if (!assigned.contains(ref)) stop(running, Stop::Unwanted, now_ms, actions);
}

void Agent::cancel(const AttemptRef& ref, std::int64_t now_ms, Actions& actions) {
  if (queued_refs_.erase(ref) > 0) {
    std::erase_if(queued_, [&](const Assignment& a) { return a.ref == ref; });
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
  const auto canceled = set_of(orders.canceled), acked = set_of(orders.acked);
  for (const Assignment& a : orders.assigned) {
    if (finished_.contains(a.ref) || running_.contains(a.ref) || canceled.contains(a.ref) || acked.contains(a.ref) ||
        !queued_refs_.insert(a.ref).second)
      continue;
    queued_.push_back(a);
    actions.state_changed = true;
  }
}

bool Agent::has_room_for(const Assignment& next) const {
  if (running_.empty()) return true;  // a job larger than the machine runs alone
  return std::ssize(running_) < config_.slots && used_cores_ + next.cores <= config_.cores &&
         used_ram_mb_ + next.ram_mb <= config_.ram_mb;
}

bool Agent::may_start(std::int64_t now_ms) const {
  return !drain_ordered_ && !drain_requested_ && trouble_.empty() && has_seen_orders_ && now_ms <= lease_until_ms_;
}

void Agent::start_queued(std::int64_t now_ms, Actions& actions) {
  while (may_start(now_ms) && !queued_.empty() && has_room_for(queued_.front())) {
    const Assignment next = queued_.front();
    queued_.pop_front();
    queued_refs_.erase(next.ref);
    running_[next.ref] = {.assignment = next,
                          .figures = {.ref = next.ref, .phase = "starting"},
                          .started_ms = now_ms,
                          .active_ms = now_ms};
    used_cores_ += next.cores;
    used_ram_mb_ += next.ram_mb;
    actions.start.push_back(next);
    actions.state_changed = true;
  }
}

void Agent::stop(Running& running, Stop why, std::int64_t now_ms, Actions& actions) {
  if (running.stop != Stop::None) return;
  running.stop = why;
  // Memory goes faster than a polite request is heard.
  const bool at_once = why == Stop::TooMuchMemory || why == Stop::MachineFull;
  running.kill_at_ms = now_ms + kTermToKillMs;
  actions.signals.push_back({running.assignment.ref, at_once ? SIGKILL : SIGTERM});
  actions.state_changed = true;
}

void Agent::stop_beyond_limits(Running& running, std::int64_t now_ms, Actions& actions) {
  const std::int64_t timeout_ms = std::int64_t{running.assignment.timeout_s} * 1000;
  if (running.figures.rss_mb > ram_limit_mb(running.assignment)) stop(running, Stop::TooMuchMemory, now_ms, actions);
  if (timeout_ms > 0 && now_ms - running.started_ms >= timeout_ms) stop(running, Stop::TimedOut, now_ms, actions);
  if (now_ms - running.active_ms >= config_.stuck_after_ms) stop(running, Stop::Stuck, now_ms, actions);
  if (running.stop != Stop::None && now_ms >= running.kill_at_ms)
    actions.signals.push_back({running.assignment.ref, SIGKILL});
}

void Agent::relieve_machine(std::int64_t now_ms, std::int64_t free_ram_mb, Actions& actions) {
  if (free_ram_mb >= kMachineFullMb) return;
  const auto excess_mb = [](const auto& entry) { return entry.second.figures.rss_mb - entry.second.assignment.ram_mb; };
  const auto most = std::max_element(running_.begin(), running_.end(),
                                     [&](const auto& a, const auto& b) { return excess_mb(a) < excess_mb(b); });
  if (most != running_.end() && excess_mb(*most) > 0) stop(most->second, Stop::MachineFull, now_ms, actions);
}

Actions Agent::on_tick(std::int64_t now_ms, std::int64_t free_ram_mb) {
  Actions actions;
  for (auto& [ref, running] : running_) stop_beyond_limits(running, now_ms, actions);
  relieve_machine(now_ms, free_ram_mb, actions);
  start_queued(now_ms, actions);
  return actions;
}

Actions Agent::on_progress(const RunningAttempt& seen, std::int64_t cpu_ticks, std::int64_t now_ms) {
  Actions actions;
  const auto found = running_.find(seen.ref);
  if (found == running_.end()) return actions;
  Running& running = found->second;
  RunningAttempt& known = running.figures;
  actions.state_changed = known.phase != seen.phase || known.progress != seen.progress;
  if (actions.state_changed || cpu_ticks != running.cpu_ticks) running.active_ms = now_ms;
  running.cpu_ticks = cpu_ticks;
  const std::int32_t rss_when_stopped_mb = known.rss_mb;
  known = seen;
  if (running.stop != Stop::None) known.rss_mb = std::max(seen.rss_mb, rss_when_stopped_mb);  // people read it
  return actions;
}

Actions Agent::on_lost(const std::vector<AttemptRef>& refs, std::int64_t now_ms) {
  Actions actions;
  for (const AttemptRef& ref : refs) {
    const auto found = running_.find(ref);
    if (found == running_.end()) continue;
    forget_running(found);
    remember_finished(ref);
    actions.state_changed = true;
  }
  start_queued(now_ms, actions);
  return actions;
}

Actions Agent::on_trouble(const std::string& trouble, std::int64_t now_ms) {
  Actions actions;
  actions.state_changed = trouble != trouble_;
  trouble_ = trouble;
  start_queued(now_ms, actions);
  return actions;
}

Actions Agent::on_drain_request() {
  drain_requested_ = true;
  queued_.clear();
  queued_refs_.clear();
  Actions actions;
  actions.state_changed = true;
  return actions;
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
    case Stop::Stuck:
      return failed(
          Outcome::Failed, ErrorKind::Resource,
          fmt::format("hung: no progress and no processor time used for {} s", config_.stuck_after_ms / 1000));
    case Stop::MachineFull:
      return failed(Outcome::Failed, ErrorKind::Resource,
                    fmt::format("stopped because the machine ran out of memory: it used {} MB, {} MB were reserved",
                                running.figures.rss_mb, running.assignment.ram_mb));
    case Stop::TooMuchMemory:
      return failed(Outcome::Failed, ErrorKind::Resource,
                    fmt::format("used {} MB of memory; {} MB were reserved, the limit is {} MB", running.figures.rss_mb,
                                running.assignment.ram_mb, ram_limit_mb(running.assignment)));
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
  forget_running(found);
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
  if (!finished_.insert(ref).second) return;
  finished_in_order_.push_back(ref);
  if (finished_in_order_.size() <= kMaxRecentlyFinished) return;
  finished_.erase(finished_in_order_.front());
  finished_in_order_.pop_front();
}

void Agent::forget_running(std::map<AttemptRef, Running>::iterator running) {
  used_cores_ -= running->second.assignment.cores;
  used_ram_mb_ -= running->second.assignment.ram_mb;
  running_.erase(running);
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
  r.trouble = trouble_;
  r.tags = config_.tags;
  r.kinds = config_.kinds;
  r.build = config_.build;
  r.draining = drain_ordered_ || drain_requested_;
  r.epoch_seen = epoch_seen_;
  r.orders_seq_seen = orders_seq_seen_;
  for (const auto& [ref, running] : running_) r.running.push_back(running.figures);
  for (const Assignment& a : queued_) r.running.push_back({a.ref, "queued", 0, 0});
  r.done_unacked = done_unacked_;
  sent_.emplace_back(r.seq, machine.now_ms);
  if (sent_.size() > kMaxSentRemembered) sent_.pop_front();
  return r;
}

}  // namespace vantage
