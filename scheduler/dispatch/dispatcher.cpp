#include "scheduler/dispatch/dispatcher.h"

#include <fmt/format.h>

#include <algorithm>

#include "scheduler/dispatch/retry.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// A result that is reported but cannot be read may be on its way through network storage.
constexpr std::int64_t kStorageLagMs = 10'000;
/// Orders that a living worker did not take in this time are given to another.
constexpr std::int64_t kTakeUpMs = 5'000;
constexpr std::int64_t kWorkerRowMs = 5'000;

bool has_started(const RunningAttempt& running) { return !running.phase.empty() && running.phase != "queued"; }

bool contains(const std::vector<AttemptRef>& sorted, const AttemptRef& ref) {
  return std::binary_search(sorted.begin(), sorted.end(), ref);
}

bool same_machine(const WorkerReport& a, const WorkerReport& b) {
  return a.incarnation == b.incarnation && a.host == b.host && a.pool == b.pool && a.slots == b.slots &&
         a.cores == b.cores && a.ram_mb == b.ram_mb && a.draining == b.draining && a.tags == b.tags &&
         a.kinds == b.kinds && a.trouble == b.trouble;
}

}  // namespace

Dispatcher::Dispatcher(Store& store, Planner& planner, Options options)
    : store_(store),
      planner_(planner),
      options_(std::move(options)),
      storage_([&planner](ShotId shot) { return planner.private_folder(shot).parent_path(); }) {}

double Dispatcher::jitter() { return static_cast<double>(options_.random() >> 11U) * 0x1p-53; }

void Dispatcher::recover(std::int64_t now_ms) {
  workers_.clear();
  to_greet_.clear();
  may_claim_ = true;
  const std::string last = store_.meta("epoch");
  epoch_ = (last.empty() ? 0 : std::stoll(last)) + 1;
  store_.set_meta("epoch", std::to_string(epoch_));
  store_.set_meta("farm_id", options_.farm_id);
  reconcile_until_ms_ = now_ms + options_.lease_ms;
  for (Query q = store_.db().query("SELECT id, incarnation, hours, set_aside FROM worker"); q.step();) {
    LiveWorker& worker = workers_[q.text(0)];
    worker.report.worker_id = q.text(0);
    worker.report.incarnation = q.integer(1);
    worker.hours = WorkingHours::parse(q.text(2));
    worker.set_aside = q.text(3);
  }
  for (auto& [id, worker] : workers_) {
    worker.drained = !store_.meta("drain/" + id).empty();
    recall_standing(id, worker);
  }
  for (const AttemptRow& attempt : store_.open_attempts()) expect_back(attempt, now_ms);
  planner_.resume();
}

void Dispatcher::expect_back(const AttemptRow& attempt, std::int64_t now_ms) {
  const JobRow job = *store_.job({attempt.ref.job_id});
  store_.move(job.id, JobState::Reconnect, job.reason);
  LiveWorker& worker = workers_[attempt.worker_id];
  try {
    Held held = held_of(job, attempt.ref, attempt.log_path, Spec::IsThere, now_ms);
    held.started = attempt.state == "running";
    held.reconnects = true;
    worker.held.insert_or_assign(attempt.ref, std::move(held));
  } catch (const DatabaseError&) {
    throw;
  } catch (const Error& e) {  // its footage is gone: the next claim says so
    lose(worker, attempt.ref, e.what());
  }
}

Dispatcher::Listed::Listed(const WorkerReport& report) {
  for (const auto& item : report.running) running.push_back(item.ref);
  for (const auto& item : report.done_unacked) done.push_back(item.ref);
  for (auto* refs : {&running, &done})
    if (!std::is_sorted(refs->begin(), refs->end())) std::sort(refs->begin(), refs->end());
}

void Dispatcher::on_report(const WorkerReport& report, std::int64_t now_ms) {
  stop_revoked();
  if (report.epoch_seen != epoch_) return greet(report);
  LiveWorker& worker = workers_[report.worker_id];
  const WorkerReport& last = worker.report;
  const bool older = report.incarnation < last.incarnation ||
                     (report.incarnation == last.incarnation && worker.seen_ms > 0 && report.seq <= last.seq);
  if (older) return;
  const bool reborn = last.incarnation != 0 && report.incarnation != last.incarnation;
  note_worker(worker, report, now_ms);
  for (const auto& running : report.running) on_running(worker, running, now_ms);
  for (const auto& done : report.done_unacked) on_done(worker, done, now_ms);
  stop_revoked();
  const Listed listed(report);
  drop_forgotten(worker, listed, reborn, now_ms);
  forget_settled(worker, listed);
}

/// Nothing is noted of it: who it is and what it has counts when it says so in this epoch.
void Dispatcher::greet(const WorkerReport& report) {
  const auto known = workers_.find(report.worker_id);
  if (known != workers_.end() && report.incarnation < known->second.report.incarnation) return;
  to_greet_.insert_or_assign(report.worker_id, report);
}

void Dispatcher::on_stall(std::int64_t stall_ms) {
  for (auto& [id, worker] : workers_) {
    if (worker.seen_ms > 0) worker.seen_ms += stall_ms;
    for (auto& [ref, held] : worker.held) {
      held.lease_until_ms += stall_ms;
      held.claimed_ms += stall_ms;
    }
  }
  reconcile_until_ms_ += stall_ms;
}

void Dispatcher::note_worker(LiveWorker& worker, const WorkerReport& report, std::int64_t now_ms) {
  const bool news = worker.seen_ms == 0 || worker.lost || !same_machine(worker.report, report);
  if (worker.report.incarnation != report.incarnation)
    worker.canceled.clear(), worker.acked.clear(), worker.changed = true;
  worker.report = report;
  worker.seen_ms = now_ms;
  worker.lost = false;
  may_claim_ |= news;
  if (!news && now_ms - worker.written_ms < kWorkerRowMs) return;
  store_.upsert_worker(report, std::string(worker.state()));
  if (news)
    store_.add_event(std::nullopt, std::nullopt, report.worker_id, "worker",
                     fmt::format("on {}: {} slots, {} cores, {} MB{}", report.host, report.slots, report.cores,
                                 report.ram_mb, report.trouble.empty() ? "" : "; takes no work: " + report.trouble));
  worker.written_ms = now_ms;
}

void Dispatcher::on_running(LiveWorker& worker, const RunningAttempt& running, std::int64_t now_ms) {
  const auto found = worker.held.find(running.ref);
  if (found == worker.held.end()) {
    readopt_or_cancel(worker, running, now_ms);
    return;
  }
  Held& held = found->second;
  held.lease_until_ms = now_ms + options_.lease_ms;
  const bool starts = has_started(running) && !held.started;
  if (starts) store_.start_attempt(running.ref);
  held.started |= starts;
  if (starts || held.reconnects) {
    const JobRow job = *store_.job({running.ref.job_id});
    store_.move(job.id, held.started ? JobState::Running : JobState::Leased, job.reason);
    held.reconnects = false;
    planner_.touch(held.shot);
  }
  if (held.started && (held.phase != running.phase || held.progress != running.progress)) {
    store_.set_progress({running.ref.job_id}, running.phase, running.progress);
    held.phase = running.phase;
    held.progress = running.progress;
    planner_.touch(held.shot);
  }
}

/// A worker reports an attempt that it should not have: thought lost, but its job was not given to another yet?
void Dispatcher::readopt_or_cancel(LiveWorker& worker, const RunningAttempt& running, std::int64_t now_ms) {
  const auto attempt = store_.attempt(running.ref);
  const auto job = attempt ? store_.job({running.ref.job_id}) : std::nullopt;
  const bool still_wanted = job && attempt->outcome == "lost" && job->state == JobState::Ready &&
                            job->num_attempts == running.ref.number && job->key == attempt->key;
  if (!still_wanted) {
    if (worker.canceled.insert(running.ref).second) worker.changed = true;
    return;
  }
  store_.reopen_attempt(running.ref);
  store_.move(job->id, JobState::Leased, job->reason);
  worker.held.insert_or_assign(running.ref, held_of(*job, running.ref, attempt->log_path, Spec::IsThere, now_ms));
  worker.changed = true;
  on_running(worker, running, now_ms);
}

void Dispatcher::on_done(LiveWorker& worker, const DoneAttempt& done, std::int64_t now_ms) {
  if (worker.acked.contains(done.ref)) return;  // the ack is in every orders until the worker has seen it
  stop_revoked();
  const auto held = worker.held.find(done.ref);
  const auto attempt = held == worker.held.end() ? store_.attempt(done.ref)
                                                 : std::optional(AttemptRow{.ref = done.ref,
                                                                            .worker_id = {},
                                                                            .key = held->second.key,
                                                                            .state = "running",
                                                                            .outcome = {},
                                                                            .log_path = {}});
  if (!attempt) {
    store_.add_event(
        std::nullopt, std::nullopt, worker.report.worker_id, "warning",
        fmt::format("reports attempt {} of job {}, which nobody ordered", done.ref.number, done.ref.job_id));
    acknowledge(worker, done.ref);
    return;
  }
  if (done.outcome == Outcome::Done) {
    if (!accept(worker, *attempt, done, now_ms)) return;
  } else if (attempt->open()) {
    fail(worker, *attempt, done, now_ms);
  }
  worker.held.erase(done.ref);
  acknowledge(worker, done.ref);
}

/// The store is the truth: a result counts when its manifest is there and is what the worker says, whoever made it and
/// however late. Of a kind that leaves nothing behind the worker's word is all there is. False: not readable yet, ask
/// again.
bool Dispatcher::accept(LiveWorker& worker, const AttemptRow& attempt, const DoneAttempt& done, std::int64_t now_ms) {
  const JobBrief job = *store_.brief({done.ref.job_id});
  const bool wanted = (is_active(job.state) || job.state == JobState::Ready || job.state == JobState::Paused) &&
                      job.key == attempt.key && attempt.outcome != "done";
  if (!wanted) {  // a repeated report, or a result that came too late: it stays in the store, to be found by its key
    if (attempt.open()) store_.end_attempt(done.ref, "stale", done);
    return true;
  }
  const auto content = planner_.content_made(job);
  if (!content || (planner_.publishes(job.kind) && *content != done.content)) {
    const auto held = worker.held.find(done.ref);
    if (held == worker.held.end()) return true;  // ended already: the job will run again
    held->second.lease_until_ms = now_ms + options_.lease_ms;
    if (held->second.invalid_since_ms == 0) held->second.invalid_since_ms = now_ms;
    if (now_ms - held->second.invalid_since_ms < kStorageLagMs) return false;
    DoneAttempt failure = done;
    failure.outcome = Outcome::Failed;
    failure.error_kind = to_string(ErrorKind::Transient);
    failure.message = fmt::format("{}: reported done, but its artifact in the store is not valid", job.name);
    fail(worker, attempt, failure, now_ms);
    return true;
  }
  planner_.compare_with_suspect(job, job.key, *content);
  store_.finish(done.ref, done, *content);
  if (job.num_attempts > 1) planner_.revoke(job.id);  // another attempt of the same job, if there is one
  if (is_selftest(job.kind)) {
    end_selftest(worker, *store_.job(job.id), "");
    return true;
  }
  note_success(worker, job.id, job.kind);
  const auto mean = mean_wall_ms_.try_emplace(job.kind, static_cast<double>(done.wall_ms)).first;
  mean->second += 0.1 * (static_cast<double>(done.wall_ms) - mean->second);
  planner_.finished(job.id);
  return true;
}

void Dispatcher::fail(LiveWorker& worker, const AttemptRow& attempt, const DoneAttempt& done, std::int64_t now_ms) {
  const JobRow job = *store_.job({done.ref.job_id});
  const bool may_be_storage = error_kind_from(done.error_kind) != ErrorKind::BadInput;
  const std::string storage_trouble = may_be_storage ? storage_.look(job.shot, now_ms) : "";
  const RetryDecision decision =
      storage_trouble.empty() ? decide_retry(job, done, jitter()) : without_blame(job, storage_trouble);
  const bool crashed = done.outcome == Outcome::Crashed;
  store_.end_attempt(attempt.ref,
                     crashed                             ? "crashed"
                     : done.outcome == Outcome::Canceled ? "canceled"
                                                         : "failed",
                     done);
  if (is_selftest(job.kind)) return end_selftest(worker, job, done.message);
  if (storage_trouble.empty() && done.damaged_job.empty()) note_failure(worker, job, done);
  note_decision(job, decision);
  store_.set_retry(job.id, decision.num_failures, decision.num_crashes, store_.clock().wall_ms() + decision.delay_ms);
  store_.set_resources(job.id, decision.ram_mb, decision.timeout_s);
  store_.set_error(job.id, done.error_kind, done.message);
  store_.move(job.id, decision.to, decision.reason);
  planner_.touch(job.shot);
  worker.changed = true;
  if (is_finished(decision.to)) planner_.finished(job.id);
  if (!done.damaged_job.empty()) make_damaged_input_again(job, done);
}

/// The worker found by its hash that an input is not what it was: it is made again, and what was made of it is looked
/// at anew.
void Dispatcher::make_damaged_input_again(const JobRow& job, const DoneAttempt& done) {
  const auto input = store_.find_job(job.shot, done.damaged_job);
  if (!input || !is_good(input->state)) return;  // somebody else found it, too
  store_.add_event(job.shot, input->id, "", "warning", done.message);
  planner_.rerun(job.shot, {input->id});
}

/// What people should know of besides the job's own history.
void Dispatcher::note_decision(const JobRow& job, const RetryDecision& decision) {
  if (decision.to == JobState::Quarantined)
    store_.add_event(job.shot, job.id, "", "decision", fmt::format("{} is quarantined: {}", job.name, decision.reason));
  if (decision.to == JobState::Ready && decision.ram_mb != job.ram_mb)
    store_.add_event(job.shot, job.id, "", "decision",
                     fmt::format("{} gets {} MB and {} s from now on: {}", job.name, decision.ram_mb,
                                 decision.timeout_s, decision.reason));
}

/// Held attempts that the worker does not list: it was restarted, it dropped them, or it never took them.
void Dispatcher::drop_forgotten(LiveWorker& worker, const Listed& listed, bool reborn, std::int64_t now_ms) {
  const WorkerReport& report = worker.report;
  std::vector<std::pair<AttemptRef, std::string>> gone;
  for (const auto& [ref, held] : worker.held) {
    if (contains(listed.running, ref) || contains(listed.done, ref)) continue;
    const bool told =
        held.assigned_seq > 0 && report.epoch_seen == epoch_ && report.orders_seq_seen >= held.assigned_seq;
    if (reborn)
      gone.emplace_back(ref, "was restarted");
    else if (told)
      gone.emplace_back(ref, "does not have it any more");
    else if (held.assigned_seq > 0 && now_ms - held.claimed_ms > kTakeUpMs)
      gone.emplace_back(ref, "did not take it up");
  }
  for (const auto& [ref, why] : gone) lose(worker, ref, why);
}

void Dispatcher::acknowledge(LiveWorker& worker, const AttemptRef& ref) {
  may_claim_ = true;  // it has room again
  worker.acked.insert(ref);
  worker.changed = true;
}

void Dispatcher::forget_settled(LiveWorker& worker, const Listed& listed) {
  std::erase_if(worker.acked, [&](const AttemptRef& ref) { return !contains(listed.done, ref); });
  const WorkerReport& report = worker.report;
  const bool heard = report.epoch_seen == epoch_ && report.orders_seq_seen >= worker.changed_seq;
  std::erase_if(worker.canceled, [&](const AttemptRef& ref) {
    return heard && !contains(listed.running, ref) && !contains(listed.done, ref);
  });
}

/// No blame: the job did nothing wrong. What the worker may still commit is found by its key.
void Dispatcher::lose(LiveWorker& worker, const AttemptRef& ref, const std::string& why) {
  worker.held.erase(ref);
  worker.changed = may_claim_ = true;
  const JobRow job = *store_.job({ref.job_id});
  DoneAttempt end;
  end.ref = ref;
  end.message = fmt::format("worker {} {}", worker.report.worker_id, why);
  store_.end_attempt(ref, "lost", end);
  if (is_selftest(job.kind)) return store_.move(job.id, JobState::Failed, end.message);
  if (planner_.salvage(job, JobState::Done, job.reason)) return;
  store_.move(job.id, JobState::Ready, end.message);
  planner_.touch(job.shot);
}

/// Attempts that the planner has ended.
void Dispatcher::stop_revoked() {
  for (const AttemptRow& attempt : planner_.take_revoked()) {
    LiveWorker& worker = workers_[attempt.worker_id];
    worker.held.erase(attempt.ref);
    worker.canceled.insert(attempt.ref);
    worker.changed = may_claim_ = true;
  }
}

int Dispatcher::num_live_workers() const {
  return static_cast<int>(std::count_if(workers_.begin(), workers_.end(), [](const auto& entry) {
    return entry.second.seen_ms > 0 && !entry.second.lost;
  }));
}

}  // namespace vantage
