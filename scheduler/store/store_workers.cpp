/// Store: workers and how they stand.
#include <fmt/format.h>

#include "scheduler/store/store.h"

namespace vantage {

void Store::upsert_worker(const WorkerReport& r, const std::string& state) {
  const std::int64_t now_ms = clock_.wall_ms();
  db_.run(
      "INSERT INTO worker (id, incarnation, host, pool, slots, cores, ram_mb, free_disk_mb, state, last_seen_ms, tags, "
      "kinds, build, trouble, skew_ms) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (id) DO UPDATE "
      "SET incarnation = excluded.incarnation, host = excluded.host, pool = excluded.pool, slots = excluded.slots, "
      "cores = excluded.cores, ram_mb = excluded.ram_mb, free_disk_mb = excluded.free_disk_mb, state = excluded.state, "
      "last_seen_ms = excluded.last_seen_ms, tags = excluded.tags, kinds = excluded.kinds, build = excluded.build, "
      "trouble = excluded.trouble, skew_ms = excluded.skew_ms",
      r.worker_id, r.incarnation, r.host, r.pool, r.slots, r.cores, r.ram_mb, r.free_disk_mb, state, now_ms,
      fmt::format("{}", fmt::join(r.tags, " ")), fmt::format("{}", fmt::join(r.kinds, " ")), r.build, r.trouble,
      r.wall_ms == 0 ? 0 : r.wall_ms - now_ms);
}

void Store::set_worker_hours(const std::string& id, const std::string& hours) {
  db_.run("UPDATE worker SET hours = ? WHERE id = ?", hours, id);
}

void Store::set_worker_set_aside(const std::string& id, const std::string& why) {
  db_.run("UPDATE worker SET set_aside = ? WHERE id = ?", why, id);
}

void Store::put_worker_failure(const std::string& worker, const WorkerFailure& f) {
  db_.run(
      "INSERT OR REPLACE INTO worker_failure (worker_id, job_id, kind, at_ms, of_kind, in_row) VALUES (?, ?, ?, ?, ?, "
      "?)",
      worker, f.job.value, f.kind, f.at_ms, f.of_kind ? 1 : 0, f.in_row ? 1 : 0);
}

void Store::forget_worker_failures(const std::string& worker) {
  db_.run("DELETE FROM worker_failure WHERE worker_id = ?", worker);
}

std::vector<Store::WorkerFailure> Store::worker_failures(const std::string& worker) {
  std::vector<WorkerFailure> out;
  for (Query q =
           db_.query("SELECT job_id, kind, at_ms, of_kind, in_row FROM worker_failure WHERE worker_id = ?", worker);
       q.step();)
    out.push_back({.job = {q.integer(0)},
                   .kind = q.text(1),
                   .at_ms = q.integer(2),
                   .of_kind = q.integer(3) != 0,
                   .in_row = q.integer(4) != 0});
  return out;
}

}  // namespace vantage
