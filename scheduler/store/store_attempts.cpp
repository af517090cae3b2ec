#include <fmt/format.h>

#include "scheduler/store/job_columns.h"
#include "scheduler/store/store.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr std::string_view kAttemptColumns = "job_id, number, token, worker_id, key, state, outcome, log_path";

AttemptRow attempt_from(const Query& q) {
  return {.ref = {.job_id = q.integer(0), .number = static_cast<std::int32_t>(q.integer(1)), .token = q.integer(2)},
          .worker_id = q.text(3),
          .key = q.text(4),
          .state = q.text(5),
          .outcome = q.text(6),
          .log_path = q.text(7)};
}

}  // namespace

void Store::begin_attempt(const JobRow& job, const AttemptRef& ref, const std::string& worker_id,
                          const std::string& log_path) {
  const JobBrief before = check_move(job.id, JobState::Leased);
  check(ref.number == before.num_attempts + 1, "numbers of attempts are never used twice");
  db_.run(
      "UPDATE job SET state = 'leased', num_attempts = ?, phase = '', progress = 0, finished_ms = NULL WHERE id = ?",
      ref.number, ref.job_id);
  db_.run(
      "INSERT INTO attempt (job_id, number, token, worker_id, key, state, log_path, leased_ms) "
      "VALUES (?, ?, ?, ?, ?, 'leased', ?, ?)",
      ref.job_id, ref.number, ref.token, worker_id, job.key, log_path, clock_.wall_ms());
  JobBrief after = before;
  after.state = JobState::Leased;
  count(before, -1);
  count(after, 1);
}

void Store::start_attempt(const AttemptRef& ref) {
  db_.run("UPDATE attempt SET state = 'running', started_ms = ? WHERE job_id = ? AND number = ? AND state = 'leased'",
          clock_.wall_ms(), ref.job_id, ref.number);
}

void Store::end_attempt(const AttemptRef& ref, const std::string& outcome, const DoneAttempt& d) {
  db_.run(
      "UPDATE attempt SET state = 'ended', outcome = ?, error_kind = ?, error = ?, exit_code = ?, signal = ?, "
      "ended_ms = ?, wall_ms = ?, peak_rss_mb = ? WHERE job_id = ? AND number = ?",
      outcome, d.error_kind, d.message, d.exit_code, d.signal, clock_.wall_ms(), d.wall_ms, d.peak_rss_mb, ref.job_id,
      ref.number);
  ++num_ended_[outcome];
  add_event(std::nullopt, JobId{ref.job_id}, "", "attempt",
            d.message.empty() ? fmt::format("attempt {} {}", ref.number, outcome)
                              : fmt::format("attempt {} {}: {}", ref.number, outcome, d.message));
}

void Store::reopen_attempt(const AttemptRef& ref) {
  db_.run("UPDATE attempt SET state = 'leased', outcome = '', ended_ms = NULL WHERE job_id = ? AND number = ?",
          ref.job_id, ref.number);
}

std::optional<AttemptRow> Store::attempt(const AttemptRef& ref) {
  static const std::string sql =
      fmt::format("SELECT {} FROM attempt WHERE job_id = ? AND number = ? AND token = ?", kAttemptColumns);
  Query q = db_.query(sql, ref.job_id, ref.number, ref.token);
  return q.step() ? std::optional(attempt_from(q)) : std::nullopt;
}

std::vector<AttemptRow> Store::open_attempts() {
  static const std::string sql =
      fmt::format("SELECT {} FROM attempt INDEXED BY attempt_open WHERE state <> 'ended' ORDER BY id", kAttemptColumns);
  std::vector<AttemptRow> rows;
  for (Query q = db_.query(sql); q.step();) rows.push_back(attempt_from(q));
  return rows;
}

std::vector<AttemptRow> Store::open_attempts_of(JobId job) {
  static const std::string sql =
      fmt::format("SELECT {} FROM attempt WHERE job_id = ? AND state <> 'ended' ORDER BY id", kAttemptColumns);
  std::vector<AttemptRow> rows;
  for (Query q = db_.query(sql, job.value); q.step();) rows.push_back(attempt_from(q));
  return rows;
}

}  // namespace vantage
