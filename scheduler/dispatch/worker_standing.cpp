#include "scheduler/dispatch/worker_standing.h"

#include <algorithm>

#include "schema/base/error.h"

namespace vantage {

WorkerStanding::Effect WorkerStanding::note_failure(JobId job, const std::string& kind, std::int64_t now_ms) {
  std::erase_if(failures_, [&](const auto& entry) { return !is_fresh(entry.second, now_ms); });
  const auto num_in_row = [&] {
    return std::count_if(failures_.begin(), failures_.end(), [](const auto& entry) { return entry.second.in_row; });
  };
  const bool was_stopped = is_stopped(kind, now_ms);
  const auto num_before = num_in_row();
  failures_.insert_or_assign(job, Failure{.kind = kind, .at_ms = now_ms});
  if (num_before < kMaxInRow && num_in_row() >= kMaxInRow) return Effect::SetAside;
  return !was_stopped && is_stopped(kind, now_ms) ? Effect::KindStopped : Effect::None;
}

bool WorkerStanding::note_success(JobId job, const std::string& kind) {
  bool forgiven = failures_.erase(job) > 0;
  for (auto& [id, failure] : failures_) {
    const bool same_kind = failure.kind == kind;
    forgiven |= failure.in_row || (same_kind && failure.of_kind);
    failure.in_row = false;
    if (same_kind) failure.of_kind = false;
  }
  return forgiven;
}

bool WorkerStanding::has_failed(JobId job, std::int64_t now_ms) const {
  const auto found = failures_.find(job);
  return found != failures_.end() && is_fresh(found->second, now_ms);
}

bool WorkerStanding::is_stopped(const std::string& kind, std::int64_t now_ms) const {
  if (failures_.empty()) return false;
  return std::count_if(failures_.begin(), failures_.end(), [&](const auto& entry) {
           return entry.second.of_kind && entry.second.kind == kind && is_fresh(entry.second, now_ms);
         }) >= kMaxOfKind;
}

bool may_blame_worker(const DoneAttempt& attempt) {
  if (attempt.outcome == Outcome::Crashed) return true;
  if (attempt.outcome != Outcome::Failed) return false;
  const ErrorKind kind = error_kind_from(attempt.error_kind);
  return kind == ErrorKind::Crash || kind == ErrorKind::Transient || kind == ErrorKind::Resource;
}

}  // namespace vantage
