#pragma once
/// The states of a job and the moves between them, written once. Every change goes through Store::move(), which checks
/// it against this table.
///
///   blocked → ready → leased → running → done | failed | quarantined
///
/// skipped (up to date), aborted (by us: not wanted any more, or what it needs failed), canceled (by a person).
/// Side states: reconnect (the scheduler was restarted, the worker has not yet reported), paused (by a person).
#include <array>
#include <optional>
#include <string_view>

namespace vantage {

enum class JobState {
  Blocked,
  Ready,
  Leased,
  Running,
  Done,
  Failed,
  Canceled,
  Aborted,
  Quarantined,
  Skipped,
  Reconnect,
  Paused
};

constexpr std::array<std::string_view, 12> kJobStateNames = {"blocked",     "ready",   "leased",    "running",
                                                             "done",        "failed",  "canceled",  "aborted",
                                                             "quarantined", "skipped", "reconnect", "paused"};

constexpr std::string_view to_string(JobState state) { return kJobStateNames[static_cast<std::size_t>(state)]; }

constexpr std::optional<JobState> job_state_from(std::string_view word) {
  for (std::size_t i = 0; i < kJobStateNames.size(); ++i)
    if (kJobStateNames[i] == word) return static_cast<JobState>(i);
  return std::nullopt;
}

/// An attempt of it is out with a worker.
constexpr bool is_active(JobState s) {
  return s == JobState::Leased || s == JobState::Running || s == JobState::Reconnect;
}
/// Its artifact is there.
constexpr bool is_good(JobState s) { return s == JobState::Done || s == JobState::Skipped; }
/// It will never deliver, unless a person or a new plan says so.
constexpr bool is_bad(JobState s) {
  return s == JobState::Failed || s == JobState::Canceled || s == JobState::Aborted || s == JobState::Quarantined;
}
constexpr bool is_finished(JobState s) { return is_good(s) || is_bad(s); }

/// The table. A new plan may send any job back to blocked, or on to skipped or ready, or abort it.
constexpr bool may_move(JobState from, JobState to) {
  using enum JobState;
  switch (to) {
    case Blocked:
      return from != Blocked;  // a new plan, or what it needs runs again
    case Ready:
      return from != Ready;  // needs met; lease lost; retry; resume
    case Leased:
      return from == Ready || from == Reconnect;  // claimed; taken back before it started
    case Running:
      return from == Leased || from == Reconnect || from == Ready;  // Ready: a worker thought lost reports it
    case Done:
      return !is_good(from) && from != Blocked;  // also late results, whatever came between
    case Skipped:
      return !is_good(from) || from == Done;
    case Failed:
      return !is_finished(from);  // also before it runs: a source that cannot be read
    case Quarantined:
      return is_active(from);
    case Canceled:
      return !is_finished(from);
    case Aborted:
      return !is_good(from) && from != Aborted;
    case Reconnect:
      return from == Leased || from == Running;
    case Paused:
      return from == Ready || from == Blocked;
  }
  return false;
}

}  // namespace vantage
