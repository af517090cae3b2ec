#include "scheduler/upkeep/happenings.h"

#include <algorithm>

namespace vantage {
namespace {

/// Rows looked at in one read: a long read would keep the journal from being reused.
constexpr std::int64_t kRowsAtOnce = 20'000;

/// Empty for a row that nobody waits for.
std::string event_of(const std::string& kind, const std::string& text, bool of_job) {
  const auto starts = [&](const char* word) { return text.starts_with(word); };
  if (kind == "state" && !of_job) return starts("done") ? "shot_done" : starts("failed") ? "shot_failed" : "";
  if (kind == "state") return starts("quarantined") ? "job_quarantined" : "";
  if (kind == "worker") return starts("lost") ? "worker_lost" : "";
  if (kind == "decision") return text.find(" is set aside") != std::string::npos ? "worker_set_aside" : "";
  return kind == "warning" && starts("disk_low") ? "disk_low" : "";
}

Json facts_of(const Query& q, const std::string& event) {
  Json facts{{"event", event}, {"id", q.integer(0)}, {"at_ms", q.integer(1)}, {"text", q.text(3)}};
  if (!q.is_null(6)) facts["shot"] = {{"id", q.integer(6)}, {"name", q.text(7)}, {"folder", q.text(8)}};
  if (!q.is_null(4)) facts["job"] = q.text(9);
  if (!q.text(5).empty()) facts["worker"] = q.text(5);
  return facts;
}

}  // namespace

std::int64_t last_event(Sqlite& db) { return db.integer_or(0, "SELECT max(id) FROM event"); }

Happenings happenings_after(Sqlite& db, std::int64_t after) {
  Happenings found;
  found.seen_to = std::min(after + kRowsAtOnce, last_event(db));
  // A restored database may be behind what was told already.
  if (found.seen_to <= after) return found;
  for (Query q = db.query(
           "SELECT e.id, e.at_ms, e.kind, e.text, e.job_id, e.worker_id, s.id, s.name, s.folder, j.name "
           "FROM event e LEFT JOIN job j ON j.id = e.job_id "
           "LEFT JOIN shot s ON s.id = coalesce(e.shot_id, j.shot_id) "
           "WHERE e.id > ? AND e.id <= ? AND e.kind IN ('state', 'worker', 'decision', 'warning') ORDER BY e.id",
           after, found.seen_to);
       q.step();) {
    const std::string event = event_of(q.text(2), q.text(3), !q.is_null(4));
    if (!event.empty()) found.list.push_back({q.integer(0), event, facts_of(q, event)});
  }
  return found;
}

}  // namespace vantage
