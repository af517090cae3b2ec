/// Dispatcher: which workers it trusts with what, their self-tests, and their hours.
#include <fmt/format.h>

#include <algorithm>

#include "jobs/probe/selftest_job.h"
#include "scheduler/dispatch/dispatcher.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// A worker that failed its test is tested again after this long: a full disk may have been cleared meanwhile.
constexpr std::int64_t kTestAgainMs = 10 * 60'000;

}  // namespace

bool is_selftest(const std::string& kind) { return kind == SelfTestJob::spec().name; }

void Dispatcher::recall_standing(const std::string& id, LiveWorker& worker) {
  for (const auto& f : store_.worker_failures(id))
    worker.standing.restore(f.job, {.kind = f.kind, .at_ms = f.at_ms, .of_kind = f.of_kind, .in_row = f.in_row});
}

void Dispatcher::write_standing(const LiveWorker& worker) {
  const std::string& id = worker.report.worker_id;
  store_.forget_worker_failures(id);
  for (const auto& [job, f] : worker.standing.failures())
    store_.put_worker_failure(id,
                              {.job = job, .kind = f.kind, .at_ms = f.at_ms, .of_kind = f.of_kind, .in_row = f.in_row});
}

void Dispatcher::note_failure(LiveWorker& worker, const JobRow& job, const DoneAttempt& done) {
  if (!may_blame_worker(done)) return;
  const auto effect = worker.standing.note_failure(job.id, job.kind, store_.clock().wall_ms());
  write_standing(worker);
  const std::string& id = worker.report.worker_id;
  if (effect == WorkerStanding::Effect::KindStopped)
    store_.add_event(job.shot, job.id, id, "decision",
                     fmt::format("{} gets no more {} jobs where others can do them: {} different ones failed there, "
                                 "last {}: {}",
                                 id, job.kind, WorkerStanding::kMaxOfKind, job.name, done.message));
  if (effect == WorkerStanding::Effect::SetAside && worker.offers(SelfTestJob::spec().name))
    set_aside(worker, fmt::format("{} different jobs failed there in a row, last {}: {}", WorkerStanding::kMaxInRow,
                                  job.name, done.message));
}

void Dispatcher::note_success(LiveWorker& worker, JobId job, const std::string& kind) {
  if (!worker.standing.failures().empty() && worker.standing.note_success(job, kind)) write_standing(worker);
}

void Dispatcher::set_aside(LiveWorker& worker, const std::string& why) {
  worker.set_aside = why;
  worker.next_test_ms = 0;
  store_.set_worker_set_aside(worker.report.worker_id, why);
  store_.add_event(std::nullopt, std::nullopt, worker.report.worker_id, "decision",
                   fmt::format("{} is set aside until it passes its self-test: {}", worker.report.worker_id, why));
  show_state(worker);
}

void Dispatcher::forgive(LiveWorker& worker) {
  worker.standing.forgive();
  worker.set_aside.clear();
  store_.forget_worker_failures(worker.report.worker_id);
  store_.set_worker_set_aside(worker.report.worker_id, "");
  may_claim_ = true;
  show_state(worker);
}

/// The test runs beside what the worker has; throws Error(BadInput) when it cannot be tested.
void Dispatcher::start_selftest(LiveWorker& worker, std::int64_t now_ms) {
  const std::string& id = worker.report.worker_id;
  if (worker.seen_ms == 0 || worker.lost) throw Error(ErrorKind::BadInput, fmt::format("{}: is not alive", id));
  if (!worker.offers(SelfTestJob::spec().name))
    throw Error(ErrorKind::BadInput, fmt::format("{}: its program has no self-test", id));
  const auto shot = store_.newest_shot();
  if (!shot)
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: the farm has no shot yet, so there is no store that could be tested", id));
  const JobRow job = planner_.make_ready_outside_plan(
      shot->id, SelfTestJob::spec(),
      selftest_unit(id, planner_.private_folder(shot->id) / "store", worker.report.kinds, store_.clock().wall_ms()));
  if (!hand_out(worker, job, now_ms)) planner_.cancel({job.id});
}

void Dispatcher::end_selftest(LiveWorker& worker, const JobRow& job, const std::string& error) {
  if (!error.empty()) {
    store_.set_error(job.id, std::string(to_string(ErrorKind::Transient)), error);
    store_.move(job.id, JobState::Failed, error);
    set_aside(worker, error);
    worker.next_test_ms = store_.clock().monotonic_ms() + kTestAgainMs;
    return;
  }
  const std::string& id = worker.report.worker_id;
  store_.add_event(std::nullopt, std::nullopt, id, "decision",
                   worker.set_aside.empty() ? fmt::format("{} passes its self-test", id)
                                            : fmt::format("{} passes its self-test and takes work again", id));
  forgive(worker);
}

void Dispatcher::test_doubted(std::int64_t now_ms) {
  for (auto& [id, worker] : workers_) {
    if (worker.set_aside.empty() || worker.seen_ms == 0 || worker.lost || now_ms < worker.next_test_ms) continue;
    const bool at_it = std::any_of(worker.held.begin(), worker.held.end(),
                                   [](const auto& entry) { return is_selftest(entry.second.kind); });
    if (at_it || !worker.offers(SelfTestJob::spec().name)) continue;
    worker.next_test_ms = now_ms + kTestAgainMs;
    start_selftest(worker, now_ms);
  }
}

void Dispatcher::look_at_the_clock() {
  constexpr std::int64_t kMinuteMs = 60'000;
  const std::int64_t wall_ms = store_.clock().wall_ms();
  if (wall_ms / kMinuteMs == minute_seen_) return;
  minute_seen_ = wall_ms / kMinuteMs;
  for (auto& [id, worker] : workers_) {
    const bool outside = !worker.hours.are_open(wall_ms);
    if (outside == worker.outside_hours) continue;
    worker.outside_hours = outside;
    may_claim_ |= !outside;
    show_state(worker);
  }
}

void Dispatcher::show_state(const LiveWorker& worker) {
  if (worker.seen_ms > 0) store_.set_worker_state(worker.report.worker_id, std::string(worker.state()));
}

/// Another worker takes work, can do such jobs, and has not shown that it cannot. It may be busy now.
bool Dispatcher::another_could(const LiveWorker& self, const Wanted& wanted) const {
  const std::int64_t now_ms = store_.clock().wall_ms();
  return std::any_of(workers_.begin(), workers_.end(), [&](const auto& entry) {
    const LiveWorker& other = entry.second;
    return &other != &self && other.takes_work() && other.serves(wanted) &&
           !other.standing.is_stopped(std::string(wanted.kind), now_ms) &&
           (!wanted.job || !other.standing.has_failed(*wanted.job, now_ms));
  });
}

/// What a worker has failed at goes to others first; where there is no other, it may try again.
bool Dispatcher::avoids(const LiveWorker& worker, const Wanted& wanted) const {
  if (worker.standing.failures().empty()) return false;
  const std::int64_t now_ms = store_.clock().wall_ms();
  const bool doubts = wanted.job ? worker.standing.has_failed(*wanted.job, now_ms)
                                 : worker.standing.is_stopped(std::string(wanted.kind), now_ms);
  return doubts && another_could(worker, wanted);
}

}  // namespace vantage
