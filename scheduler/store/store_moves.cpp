/// Store: changes of a job's state, and what must change with it.
#include <fmt/format.h>

#include "scheduler/store/job_columns.h"
#include "scheduler/store/store.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

bool is_out(JobState state) { return state == JobState::Leased || state == JobState::Running; }

/// Is there another row that says it? See store.h.
bool deserves_event(const JobBrief& before, JobState to) {
  if (before.state == JobState::Blocked && to == JobState::Ready) return before.num_attempts > 0;
  return !is_out(to);
}

}  // namespace

void Store::count(const JobBrief& job, int sign) {
  const auto row = shot(job.shot);
  if (row && row->generation == job.generation)
    tally_.add_jobs(job.shot, job.kind, job.state, sign, sign * job.wall_ms);
  if (!job.claimable()) return;
  tally_.add_ready(job.class_id, sign);
  if (sign > 0) ++num_woken_;
}

void Store::changing(JobId id, const std::function<void()>& change) {
  count(*brief(id), -1);
  change();
  count(*brief(id), 1);
}

JobBrief Store::check_move(JobId id, JobState to) {
  auto job = brief(id);
  check(job.has_value(), "only jobs that are there change their state");
  if (job->state != to && !may_move(job->state, to))
    throw Error(ErrorKind::Bug,
                fmt::format("{}: may not move from {} to {}", job->name, to_string(job->state), to_string(to)));
  return *job;
}

void Store::after_move(const JobBrief& before, JobState to, const std::string& reason) {
  if (is_good(to) != is_good(before.state))
    db_.run("UPDATE job SET num_unmet = num_unmet + ? WHERE id IN (SELECT job_id FROM dependency WHERE needs_id = ?)",
            is_good(to) ? -1 : 1, before.id.value);
  if (deserves_event(before, to))
    add_event(before.shot, before.id, "", "state",
              reason.empty() ? std::string(to_string(to)) : fmt::format("{}: {}", to_string(to), reason));
}

void Store::move(JobId id, JobState to, const std::string& reason) {
  const JobBrief before = check_move(id, to);
  if (before.state == to) return;
  if (is_finished(to))
    db_.run("UPDATE job SET state = ?, reason = ?, phase = '', progress = ?, finished_ms = ? WHERE id = ?",
            to_string(to), reason, is_good(to) ? 1.0 : 0.0, clock_.wall_ms(), id.value);
  else
    db_.run("UPDATE job SET state = ?, reason = ?, phase = '', progress = 0, finished_ms = NULL WHERE id = ?",
            to_string(to), reason, id.value);
  JobBrief after = before;
  after.state = to;
  count(before, -1);
  count(after, 1);
  after_move(before, to, reason);
}

void Store::move_with_key(JobId id, JobState to, const std::string& reason, const Keyed& keyed) {
  const JobBrief before = check_move(id, to);
  if (keyed.forget_failures) {
    set_retry(id, 0, 0, 0);
    set_error(id, "", "");
  }
  db_.run("UPDATE job SET key = ?, identity = ?, content = ? WHERE id = ?", keyed.key, keyed.identity, keyed.content,
          id.value);
  move(id, to, reason);
}

void Store::finish(const AttemptRef& ref, const DoneAttempt& d, const std::string& content) {
  const JobBrief before = check_move({ref.job_id}, JobState::Done);
  const std::int64_t now_ms = clock_.wall_ms();
  db_.run(
      "UPDATE attempt SET state = 'ended', outcome = 'done', exit_code = ?, signal = ?, ended_ms = ?, wall_ms = ?, "
      "peak_rss_mb = ? WHERE job_id = ? AND number = ?",
      d.exit_code, d.signal, now_ms, d.wall_ms, d.peak_rss_mb, ref.job_id, ref.number);
  db_.run(
      "UPDATE job SET state = 'done', content = ?, wall_ms = ?, peak_rss_mb = ?, error_kind = '', error = '', "
      "phase = '', progress = 1, finished_ms = ? WHERE id = ?",
      content, d.wall_ms, d.peak_rss_mb, now_ms, ref.job_id);
  JobBrief after = before;
  after.state = JobState::Done;
  after.wall_ms = d.wall_ms;
  count(before, -1);
  count(after, 1);
  after_move(before, JobState::Done, fmt::format("attempt {}", ref.number));
}

}  // namespace vantage
