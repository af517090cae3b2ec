#include "scheduler/farm/progress.h"

#include "scheduler/farm/progress_query.h"
#include "scheduler/store/job_state.h"

namespace vantage {
namespace {

ShotProgress::Kind read_kind(Sqlite& db, const ShotProgress& shot, const std::string& kind) {
  ShotProgress::Kind out{.kind = kind, .num_by_state = {}};
  for (Query q = db.query("SELECT state, num, wall_ms FROM job_count WHERE shot_id = ? AND kind = ? AND num > 0",
                          shot.shot.value, kind);
       q.step();) {
    const int num = static_cast<int>(q.integer(1));
    out.num_by_state[q.text(0)] = num;
    out.num_jobs += num;
    if (is_finished(job_state_from(q.text(0)).value())) out.num_finished += num, out.wall_ms += q.integer(2);
  }
  return out;
}

std::vector<ShotProgress::Running> read_running(Sqlite& db, ShotId shot) {
  std::vector<ShotProgress::Running> out;
  for (Query q = db.query("SELECT job.id, job.name, attempt.worker_id, job.phase, job.progress "
                          "FROM attempt INDEXED BY attempt_open CROSS JOIN job ON job.id = attempt.job_id WHERE "
                          "attempt.state <> 'ended' AND job.state = 'running' "
                          "AND job.shot_id = ? ORDER BY attempt.id",
                          shot.value);
       q.step();)
    out.push_back(
        {.job = {q.integer(0)}, .name = q.text(1), .worker = q.text(2), .phase = q.text(3), .progress = q.real(4)});
  return out;
}

/// Of each kind that has any: the index of jobs leads to them only by kind and state.
std::vector<ShotProgress::Failure> read_failures(Sqlite& db, const ShotProgress& shot) {
  constexpr std::size_t kMaxNamed = 20;
  std::vector<ShotProgress::Failure> out;
  for (const ShotProgress::Kind& kind : shot.kinds) {
    if (!kind.num_by_state.contains("failed") && !kind.num_by_state.contains("quarantined")) continue;
    for (Query q = db.query("SELECT name, state, error_kind, error FROM job WHERE shot_id = ? AND generation = ? "
                            "AND kind = ? AND state IN ('failed', 'quarantined') ORDER BY finished_ms, id LIMIT ?",
                            shot.shot.value, shot.generation, kind.kind, kMaxNamed - out.size());
         q.step();)
      out.push_back({.name = q.text(0), .state = q.text(1), .error_kind = q.text(2), .error = q.text(3)});
  }
  return out;
}

}  // namespace

int ShotProgress::num_jobs() const {
  int sum = 0;
  for (const auto& kind : kinds) sum += kind.num_jobs;
  return sum;
}

int ShotProgress::num_finished() const {
  int sum = 0;
  for (const auto& kind : kinds) sum += kind.num_finished;
  return sum;
}

std::optional<ShotProgress> read_progress(Sqlite& db, ShotId shot, const std::vector<std::string>& kind_names) {
  ShotProgress out;
  {
    Query q = db.query("SELECT name, folder, state, error, generation FROM shot WHERE id = ?", shot.value);
    if (!q.step()) return std::nullopt;
    out.shot = shot;
    out.name = q.text(0);
    out.folder = q.text(1);
    out.state = q.text(2);
    out.error = q.text(3);
    out.generation = q.integer(4);
  }
  for (const auto& name : kind_names) {
    auto kind = read_kind(db, out, name);
    if (kind.num_jobs > 0) out.kinds.push_back(std::move(kind));
  }
  out.running = read_running(db, shot);
  out.failures = read_failures(db, out);
  out.num_workers = static_cast<int>(db.integer_or(0, "SELECT count(*) FROM worker WHERE state <> 'lost'"));
  return out;
}

}  // namespace vantage
