/// Dispatcher: leases that run out, and which worker gets which job.
#include <fmt/format.h>

#include <algorithm>

#include "scheduler/dispatch/dispatcher.h"
#include "scheduler/dispatch/spec_file.h"
#include "schema/base/error.h"
#include "schema/base/hash.h"

namespace vantage {
namespace {

/// Jobs shorter than this are handed out one ahead per slot: the way there and back would show in the total.
constexpr double kPrefetchBelowMs = 2'000;
/// A worker with less room than this would only fail.
constexpr int kMinFreeDiskMb = 100;

}  // namespace

void Dispatcher::on_tick(std::int64_t now_ms) {
  stop_revoked();
  expire_leases(now_ms);
  claim_for_all(now_ms);
}

void Dispatcher::expire_leases(std::int64_t now_ms) {
  for (auto& [id, worker] : workers_) {
    std::vector<AttemptRef> expired;
    for (const auto& [ref, held] : worker.held)
      if (held.lease_until_ms <= now_ms) expired.push_back(ref);
    for (const AttemptRef& ref : expired) lose(worker, ref, "was not heard of: the lease ran out");
    if (worker.seen_ms > 0 && !worker.lost && now_ms - worker.seen_ms >= options_.lease_ms) {
      worker.lost = true;
      store_.set_worker_state(id, "lost");
    }
  }
  stop_revoked();
}

Store::Fit Dispatcher::largest_worker() const {
  Store::Fit fit;
  for (const auto& [id, worker] : workers_) {
    if (!worker.takes_work()) continue;
    fit.largest_cores = std::max(fit.largest_cores, worker.report.cores);
    fit.largest_ram_mb = std::max(fit.largest_ram_mb, worker.report.ram_mb);
  }
  return fit;
}

/// First every free slot of every worker, round by round so that work spreads; then one ahead. While a job waits to run
/// alone, the first worker takes nothing else until it is empty.
void Dispatcher::claim_for_all(std::int64_t now_ms) {
  const Store::Fit largest = largest_worker();
  const std::string* reserved = nullptr;
  if (store_.waits_to_run_alone()) {
    const auto first =
        std::find_if(workers_.begin(), workers_.end(), [](const auto& w) { return w.second.takes_work(); });
    if (first != workers_.end()) reserved = &first->first;
  }
  for (const Claim claim : {Claim::Run, Claim::Prefetch}) {
    for (bool again = true; again;) {
      again = false;
      for (auto& [id, worker] : workers_) {
        if (reserved != nullptr && *reserved == id && !worker.held.empty()) continue;
        again |= worker.takes_work() && claim_one(worker, claim, largest, now_ms);
      }
    }
  }
}

bool Dispatcher::claim_one(LiveWorker& worker, Claim claim, const Store::Fit& largest, std::int64_t now_ms) {
  const auto slots = static_cast<std::size_t>(worker.report.slots);
  const bool disk_full = worker.report.free_disk_mb > 0 && worker.report.free_disk_mb < kMinFreeDiskMb;
  if (worker.held.size() >= (claim == Claim::Run ? slots : 2 * slots) || worker.runs_something_alone() || disk_full)
    return false;
  Store::Fit fit = largest;
  fit.free_cores = worker.report.cores - (claim == Claim::Run ? worker.used_cores() : 0);
  fit.free_ram_mb = worker.report.ram_mb - (claim == Claim::Run ? worker.used_ram_mb() : 0);
  fit.alone = worker.held.empty();
  const auto job = store_.next_to_claim(fit);
  if (!job) return false;
  if (claim == Claim::Prefetch) {
    const auto mean = mean_wall_ms_.find(job->kind);
    if (mean == mean_wall_ms_.end() || mean->second >= kPrefetchBelowMs) return false;
  }
  hand_out(worker, *job, now_ms);
  return true;
}

/// The job leaves the state ready: for the worker, or, when its result or its footage say otherwise, for another state.
void Dispatcher::hand_out(LiveWorker& worker, const JobRow& job, std::int64_t now_ms) {
  if (job.num_attempts > 0 && planner_.salvage(job, JobState::Skipped, "a lost attempt had finished it")) return;
  if (!planner_.move_suspect_aside(job)) return;
  try {
    if (job_key(planner_.job_file(job)) != job.key) {  // footage was replaced since the job became ready
      planner_.recheck(job);
      return;
    }
  } catch (const Error& e) {
    if (e.kind() == ErrorKind::Bug) throw;
    planner_.recheck(job);
    return;
  }
  const auto log =
      planner_.private_folder(job.shot) / "logs" / fmt::format("{}.{}.log", job.name, job.num_attempts + 1);
  std::filesystem::create_directories(log.parent_path());
  const auto token = static_cast<std::int64_t>(options_.random() >> 1U);
  const AttemptRef ref = store_.begin_attempt(job, worker.report.worker_id, token, log.string());
  store_.move(job.id, JobState::Leased, job.reason);
  store_.add_event(job.shot, job.id, worker.report.worker_id, "attempt",
                   fmt::format("attempt {} to {}", ref.number, worker.report.worker_id));
  worker.held[ref] = {.assignment = make_assignment(job, ref, log.string()),
                      .claimed_ms = now_ms,
                      .lease_until_ms = now_ms + options_.lease_ms,
                      .alone = job.num_crashes > 0};
  worker.changed = true;
  planner_.touch(job.shot);
}

Assignment Dispatcher::make_assignment(const JobRow& job, const AttemptRef& ref, const std::string& log_path) {
  const auto spec = planner_.private_folder(job.shot) / "specs" / (job.name + ".json");
  return {.ref = ref,
          .spec_path = spec.string(),
          .spec_hash = write_spec_file(spec, planner_.job_file(job)),
          .log_path = log_path,
          .cores = job.cores,
          .ram_mb = job.ram_mb,
          .timeout_s = job.timeout_s,
          .kind = fmt::format("{}/{}", job.kind, job.version)};
}

}  // namespace vantage
