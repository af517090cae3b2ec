#include <fmt/format.h>

#include "scheduler/store/job_columns.h"
#include "scheduler/store/store.h"
#include "schema/base/error.h"

namespace vantage {

JobRow job_from(const Query& q) {
  int c = 0;
  const auto number = [&] { return static_cast<int>(q.integer(c++)); };
  const auto text = [&] { return q.text(c++); };
  JobRow r;
  r.id = {q.integer(c++)};
  r.shot = {q.integer(c++)};
  r.name = text(), r.kind = text();
  r.stage = number(), r.version = number();
  r.generation = q.integer(c++);
  r.plan_hash = text(), r.params = text(), r.unit = text(), r.sources = text(), r.links = text();
  r.key = text(), r.identity = text(), r.content = text();
  r.state = job_state_from(text()).value();
  r.priority = number(), r.num_unmet = number(), r.cores = number(), r.ram_mb = number(), r.timeout_s = number();
  r.num_attempts = number(), r.num_failures = number(), r.num_crashes = number();
  r.not_before_ms = q.integer(c++);
  r.reason = text();
  return r;
}

std::optional<JobRow> Store::job(JobId id) {
  static const std::string sql = fmt::format("SELECT {} FROM job WHERE id = ?", kJobColumns);
  Query q = db_.query(sql, id.value);
  return q.step() ? std::optional(job_from(q)) : std::nullopt;
}

std::optional<JobRow> Store::find_job(ShotId shot, const std::string& name) {
  static const std::string sql = fmt::format("SELECT {} FROM job WHERE shot_id = ? AND name = ?", kJobColumns);
  Query q = db_.query(sql, shot.value, name);
  return q.step() ? std::optional(job_from(q)) : std::nullopt;
}

std::vector<JobRow> Store::jobs_of(ShotId shot) {
  static const std::string sql = fmt::format("SELECT {} FROM job WHERE shot_id = ? ORDER BY id", kJobColumns);
  std::vector<JobRow> rows;
  for (Query q = db_.query(sql, shot.value); q.step();) rows.push_back(job_from(q));
  return rows;
}

std::vector<JobId> Store::planned_in_states(ShotId shot, std::initializer_list<JobState> states,
                                            const std::string& kind) {
  std::vector<JobId> ids;
  for (const JobState state : states)
    for (Query q = db_.query("SELECT id FROM job WHERE shot_id = ?1 AND state = ?2 "
                             "AND generation = (SELECT generation FROM shot WHERE id = ?1) "
                             "AND (?3 = '' OR kind = ?3) ORDER BY id",
                             shot.value, to_string(state), kind);
         q.step();)
      ids.push_back({q.integer(0)});
  return ids;
}

bool Store::has_planned_unfinished(ShotId shot) {
  return db_.integer_or(0,
                        "SELECT EXISTS (SELECT 1 FROM job WHERE shot_id = ?1 AND generation = "
                        "(SELECT generation FROM shot WHERE id = ?1) "
                        "AND state IN ('blocked', 'ready', 'leased', 'running', 'reconnect', 'paused'))",
                        shot.value) != 0;
}

int Store::num_planned_bad(ShotId shot) {
  return static_cast<int>(db_.integer_or(
      0,
      "SELECT count(*) FROM job WHERE shot_id = ?1 AND generation = (SELECT generation FROM shot WHERE id = ?1) "
      "AND state IN ('failed', 'canceled', 'aborted', 'quarantined')",
      shot.value));
}

JobId Store::insert_job(const JobRow& r) {
  db_.run(
      "INSERT INTO job (shot_id, name, kind, stage, version, generation, plan_hash, params, unit, sources, links, "
      "state, "
      "priority, cores, ram_mb, timeout_s, created_ms) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, 'blocked', ?, ?, ?, ?, "
      "?)",
      r.shot.value, r.name, r.kind, r.stage, r.version, r.generation, r.plan_hash, r.params, r.unit, r.sources, r.links,
      r.priority, r.cores, r.ram_mb, r.timeout_s, clock_.wall_ms());
  return {db_.last_insert_id()};
}

void Store::update_plan(const JobRow& r) {
  db_.run(
      "UPDATE job SET kind = ?, stage = ?, version = ?, generation = ?, plan_hash = ?, params = ?, unit = ?, sources = "
      "?, "
      "links = ?, cores = ?, ram_mb = ?, timeout_s = ? WHERE id = ?",
      r.kind, r.stage, r.version, r.generation, r.plan_hash, r.params, r.unit, r.sources, r.links, r.cores, r.ram_mb,
      r.timeout_s, r.id.value);
}

void Store::set_generation(JobId id, std::int64_t generation) {
  db_.run("UPDATE job SET generation = ? WHERE id = ?", generation, id.value);
}

void Store::set_needs(JobId id, const std::vector<JobId>& needs, int num_unmet) {
  db_.run("DELETE FROM dependency WHERE job_id = ?", id.value);
  for (const JobId need : needs)
    db_.run("INSERT OR IGNORE INTO dependency (job_id, needs_id) VALUES (?, ?)", id.value, need.value);
  set_num_unmet(id, num_unmet);
}

void Store::set_num_unmet(JobId id, int num_unmet) {
  db_.run("UPDATE job SET num_unmet = ? WHERE id = ?", num_unmet, id.value);
}
void Store::set_key(JobId id, const std::string& key, const std::string& identity) {
  db_.run("UPDATE job SET key = ?, identity = ? WHERE id = ?", key, identity, id.value);
}
void Store::set_content(JobId id, const std::string& content) {
  db_.run("UPDATE job SET content = ? WHERE id = ?", content, id.value);
}
void Store::set_job_priority(JobId id, int priority) {
  db_.run("UPDATE job SET priority = ? WHERE id = ?", priority, id.value);
}
void Store::set_progress(JobId id, const std::string& phase, double progress) {
  db_.run("UPDATE job SET phase = ?, progress = ? WHERE id = ?", phase, progress, id.value);
}
void Store::set_resources(JobId id, int ram_mb, int timeout_s) {
  db_.run("UPDATE job SET ram_mb = ?, timeout_s = ? WHERE id = ?", ram_mb, timeout_s, id.value);
}
void Store::set_retry(JobId id, int num_failures, int num_crashes, std::int64_t not_before_ms) {
  db_.run("UPDATE job SET num_failures = ?, num_crashes = ?, not_before_ms = ? WHERE id = ?", num_failures, num_crashes,
          not_before_ms, id.value);
}
void Store::set_error(JobId id, const std::string& error_kind, const std::string& error) {
  db_.run("UPDATE job SET error_kind = ?, error = ? WHERE id = ?", error_kind, error, id.value);
}
void Store::set_cost(JobId id, std::int64_t wall_ms, int peak_rss_mb) {
  db_.run("UPDATE job SET wall_ms = ?, peak_rss_mb = ? WHERE id = ?", wall_ms, peak_rss_mb, id.value);
}

std::vector<JobId> Store::needs_of(JobId id) {
  std::vector<JobId> ids;
  for (Query q = db_.query("SELECT needs_id FROM dependency WHERE job_id = ?", id.value); q.step();)
    ids.push_back({q.integer(0)});
  return ids;
}

std::vector<JobId> Store::dependents_of(JobId id) {
  std::vector<JobId> ids;
  for (Query q =
           db_.query("SELECT child.id FROM dependency JOIN job child ON child.id = job_id JOIN job need ON need.id = "
                     "needs_id WHERE needs_id = ? AND child.generation = need.generation ORDER BY child.id",
                     id.value);
       q.step();)
    ids.push_back({q.integer(0)});
  return ids;
}

void Store::move(JobId id, JobState to, const std::string& reason) {
  const auto row = job(id);
  check(row.has_value(), "only jobs that are there change their state");
  if (row->state == to) return;
  if (!may_move(row->state, to))
    throw Error(ErrorKind::Bug,
                fmt::format("{}: may not move from {} to {}", row->name, to_string(row->state), to_string(to)));
  if (is_finished(to))
    db_.run("UPDATE job SET state = ?, reason = ?, phase = '', progress = ?, finished_ms = ? WHERE id = ?",
            to_string(to), reason, is_good(to) ? 1.0 : 0.0, clock_.wall_ms(), id.value);
  else
    db_.run("UPDATE job SET state = ?, reason = ?, phase = '', progress = 0, finished_ms = NULL WHERE id = ?",
            to_string(to), reason, id.value);
  if (is_good(to) != is_good(row->state))
    db_.run("UPDATE job SET num_unmet = num_unmet + ? WHERE id IN (SELECT job_id FROM dependency WHERE needs_id = ?)",
            is_good(to) ? -1 : 1, id.value);
  add_event(row->shot, id, "", "state",
            reason.empty() ? std::string(to_string(to)) : fmt::format("{}: {}", to_string(to), reason));
}

}  // namespace vantage
