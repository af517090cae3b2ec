#include <fmt/format.h>

#include "scheduler/store/job_columns.h"
#include "scheduler/store/store.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr std::string_view kOutlineColumns = "id, name, kind, plan_hash, content, state, generation, num_unmet";

JobOutline outline_from(const Query& q) {
  return {.id = {q.integer(0)},
          .name = q.text(1),
          .kind = q.text(2),
          .plan_hash = q.text(3),
          .content = q.text(4),
          .state = job_state_from(q.text(5)).value(),
          .generation = q.integer(6),
          .num_unmet = static_cast<int>(q.integer(7))};
}

}  // namespace

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
  r.reason = text(), r.pool = text(), r.tags = text();
  return r;
}

std::optional<JobBrief> Store::brief(JobId id) {
  Query q = db_.query(
      "SELECT shot_id, name, kind, state, generation, class_id, not_before_ms, wall_ms, num_unmet, num_attempts, "
      "links <> '[]', key FROM job WHERE id = ?",
      id.value);
  if (!q.step()) return std::nullopt;
  return JobBrief{.id = id,
                  .shot = {q.integer(0)},
                  .name = q.text(1),
                  .kind = q.text(2),
                  .key = q.text(11),
                  .state = job_state_from(q.text(3)).value(),
                  .generation = q.integer(4),
                  .class_id = q.integer(5),
                  .not_before_ms = q.integer(6),
                  .wall_ms = q.integer(7),
                  .num_unmet = static_cast<int>(q.integer(8)),
                  .num_attempts = static_cast<int>(q.integer(9)),
                  .has_links = q.integer(10) != 0};
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

std::vector<JobOutline> Store::outlines_of(ShotId shot) {
  std::vector<JobOutline> rows;
  static const std::string sql = fmt::format("SELECT {} FROM job WHERE shot_id = ? ORDER BY id", kOutlineColumns);
  for (Query q = db_.query(sql, shot.value); q.step();) rows.push_back(outline_from(q));
  return rows;
}

JobOutline Store::outline(JobId id) {
  static const std::string sql = fmt::format("SELECT {} FROM job WHERE id = ?", kOutlineColumns);
  Query q = db_.query(sql, id.value);
  check(q.step(), "jobs are never deleted");
  return outline_from(q);
}

std::vector<JobRow> Store::good_jobs_of(ShotId shot) {
  static const std::string sql = fmt::format(
      "SELECT {} FROM job WHERE shot_id = ?1 AND state IN ('done', 'skipped') AND links <> '[]' "
      "AND generation = (SELECT generation FROM shot WHERE id = ?1) ORDER BY id",
      kJobColumns);
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
  tally_.write(db_);
  return db_.integer_or(0,
                        "SELECT EXISTS (SELECT 1 FROM job_count WHERE shot_id = ? AND num > 0 "
                        "AND state IN ('blocked', 'ready', 'leased', 'running', 'reconnect', 'paused'))",
                        shot.value) != 0;
}

int Store::num_planned_bad(ShotId shot) {
  tally_.write(db_);
  return static_cast<int>(db_.integer_or(0,
                                         "SELECT sum(num) FROM job_count WHERE shot_id = ? "
                                         "AND state IN ('failed', 'canceled', 'aborted', 'quarantined')",
                                         shot.value));
}

Store::NumPlanned Store::num_planned(ShotId shot) {
  tally_.write(db_);
  Query q = db_.query("SELECT total(num), total(num * (state IN ('done', 'skipped'))) FROM job_count WHERE shot_id = ?",
                      shot.value);
  q.step();
  return {.all = static_cast<int>(q.integer(0)), .good = static_cast<int>(q.integer(1))};
}

JobId Store::insert_job(const JobRow& r) {
  const std::int64_t class_id = class_of(r, r.num_crashes > 0);
  db_.run(
      "INSERT INTO job (shot_id, name, kind, stage, version, generation, plan_hash, params, unit, sources, links, "
      "state, priority, cores, ram_mb, timeout_s, created_ms, pool, tags, class_id) "
      "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, 'blocked', ?, ?, ?, ?, ?, ?, ?, ?)",
      r.shot.value, r.name, r.kind, r.stage, r.version, r.generation, r.plan_hash, r.params, r.unit, r.sources, r.links,
      r.priority, r.cores, r.ram_mb, r.timeout_s, clock_.wall_ms(), r.pool, r.tags, class_id);
  const JobId id{db_.last_insert_id()};
  count({.id = id, .shot = r.shot, .name = {}, .kind = r.kind, .key = {}, .generation = r.generation}, 1);
  return id;
}

void Store::update_plan(const JobRow& r) {
  changing(r.id, [&] {
    db_.run(
        "UPDATE job SET kind = ?, stage = ?, version = ?, generation = ?, plan_hash = ?, params = ?, unit = ?, "
        "sources = ?, links = ?, cores = ?, ram_mb = ?, timeout_s = ?, pool = ?, tags = ?, class_id = ? WHERE id = ?",
        r.kind, r.stage, r.version, r.generation, r.plan_hash, r.params, r.unit, r.sources, r.links, r.cores, r.ram_mb,
        r.timeout_s, r.pool, r.tags, class_of(r, r.num_crashes > 0), r.id.value);
  });
}

void Store::set_generation(JobId id, std::int64_t generation) {
  changing(id, [&] { db_.run("UPDATE job SET generation = ? WHERE id = ?", generation, id.value); });
}

void Store::set_needs(JobId id, const std::vector<JobId>& needs, int num_unmet) {
  db_.run("DELETE FROM dependency WHERE job_id = ?", id.value);
  for (const JobId need : needs)
    db_.run("INSERT OR IGNORE INTO dependency (job_id, needs_id) VALUES (?, ?)", id.value, need.value);
  set_num_unmet(id, num_unmet);
}

void Store::set_num_unmet(JobId id, int num_unmet) {
  db_.run("UPDATE job SET num_unmet = ?1 WHERE id = ?2 AND num_unmet <> ?1", num_unmet, id.value);
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
  changing(id, [&] {
    const JobRow row = *job(id);
    JobRow raised = row;
    raised.ram_mb = ram_mb;
    db_.run("UPDATE job SET ram_mb = ?, timeout_s = ?, class_id = ? WHERE id = ?", ram_mb, timeout_s,
            class_of(raised, row.num_crashes > 0), id.value);
  });
}
void Store::set_retry(JobId id, int num_failures, int num_crashes, std::int64_t not_before_ms) {
  changing(id, [&] {
    db_.run("UPDATE job SET num_failures = ?, num_crashes = ?, not_before_ms = ?, class_id = ? WHERE id = ?",
            num_failures, num_crashes, not_before_ms, class_of(*job(id), num_crashes > 0), id.value);
  });
}
void Store::set_reason(JobId id, const std::string& reason) {
  db_.run("UPDATE job SET reason = ?1 WHERE id = ?2 AND reason <> ?1", reason, id.value);
}
void Store::set_error(JobId id, const std::string& error_kind, const std::string& error) {
  db_.run("UPDATE job SET error_kind = ?, error = ? WHERE id = ?", error_kind, error, id.value);
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

}  // namespace vantage
