/// Store: which jobs can be claimed, and in which order.
#include <fmt/format.h>

#include "scheduler/store/job_columns.h"
#include "scheduler/store/store.h"

namespace vantage {
namespace {

/// No try is put off for longer: the machine's clock was set back meanwhile.
constexpr std::int64_t kMaxWaitMs = 3'600'000;

}  // namespace

std::int64_t Store::class_of(const JobRow& r, bool alone) {
  const std::string name =
      fmt::format("{}|{}|{}|{}|{}|{}|{}", r.shot.value, r.kind, r.pool, r.tags, r.cores, r.ram_mb, alone ? 1 : 0);
  auto known = class_ids_.find(name);
  if (known != class_ids_.end()) return known->second;
  db_.run(
      "INSERT INTO need_class (shot_id, kind, pool, tags, cores, ram_mb, alone) VALUES (?, ?, ?, ?, ?, ?, ?) "
      "ON CONFLICT DO NOTHING",
      r.shot.value, r.kind, r.pool, r.tags, r.cores, r.ram_mb, alone ? 1 : 0);
  const std::int64_t id =
      db_.integer_or(0,
                     "SELECT id FROM need_class WHERE shot_id = ? AND kind = ? AND pool = ? AND tags = ? AND cores = ? "
                     "AND ram_mb = ? AND alone = ?",
                     r.shot.value, r.kind, r.pool, r.tags, r.cores, r.ram_mb, alone ? 1 : 0);
  class_ids_.emplace(name, id);
  return id;
}

/// The claim rule. Priority first; then the later stage, so that results come out while earlier stages still run; then
/// age. Reads one job of each class that has any: its cost does not grow with the number of jobs. Which of the classes
/// a worker can take is the dispatcher's to say; within a class, best_of_class() goes on in the same order.
std::vector<ReadyClass> Store::ready_classes() {
  tally_.write(db_);
  std::vector<ReadyClass> classes;
  for (Query q = db_.query(
           "SELECT c.id, c.shot_id, c.kind, c.pool, c.tags, c.cores, c.ram_mb, c.alone, "
           "job.priority, job.stage, job.id "
           "FROM need_class c JOIN shot ON shot.id = c.shot_id AND shot.state <> 'paused' "
           "CROSS JOIN job ON job.id = (SELECT id FROM job best WHERE best.class_id = c.id AND best.state = 'ready' "
           "AND best.not_before_ms = 0 ORDER BY best.priority DESC, best.stage DESC, best.id LIMIT 1) "
           "WHERE c.num_ready > 0 ORDER BY job.priority DESC, job.stage DESC, job.id");
       q.step();)
    classes.push_back({.id = q.integer(0),
                       .shot = {q.integer(1)},
                       .kind = q.text(2),
                       .pool = q.text(3),
                       .tags = q.text(4),
                       .cores = static_cast<int>(q.integer(5)),
                       .ram_mb = static_cast<int>(q.integer(6)),
                       .alone = q.integer(7) != 0,
                       .priority = static_cast<int>(q.integer(8)),
                       .stage = static_cast<int>(q.integer(9)),
                       .first = {q.integer(10)}});
  return classes;
}

std::vector<JobRow> Store::best_of_class(std::int64_t class_id, int limit) {
  static const std::string sql = fmt::format(
      "SELECT {} FROM job WHERE class_id = ? AND state = 'ready' AND not_before_ms = 0 "
      "ORDER BY priority DESC, stage DESC, id LIMIT ?",
      kJobColumns);
  std::vector<JobRow> rows;
  for (Query q = db_.query(sql, class_id, limit); q.step();) rows.push_back(job_from(q));
  return rows;
}

void Store::wake_waiting() {
  std::vector<JobId> due;
  const std::int64_t now_ms = clock_.wall_ms();
  for (Query q =
           db_.query("SELECT id FROM job WHERE state = 'ready' AND not_before_ms > 0 AND not_before_ms <= ? UNION "
                     "ALL SELECT id FROM job WHERE state = 'ready' AND not_before_ms > 0 AND not_before_ms > ?",
                     now_ms, now_ms + kMaxWaitMs);
       q.step();)
    due.push_back({q.integer(0)});
  for (const JobId id : due) changing(id, [&] { db_.run("UPDATE job SET not_before_ms = 0 WHERE id = ?", id.value); });
}

}  // namespace vantage
