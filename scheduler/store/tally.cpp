#include "scheduler/store/tally.h"

namespace vantage {

void Tally::add_jobs(ShotId shot, const std::string& kind, JobState state, int num, std::int64_t wall_ms) {
  Difference& difference = jobs_[{shot, kind, state}];
  difference.num += num;
  difference.wall_ms += wall_ms;
}

void Tally::write(Sqlite& db) {
  for (const auto& [what, difference] : jobs_) {
    if (difference.num == 0 && difference.wall_ms == 0) continue;
    const auto& [shot, kind, state] = what;
    db.run(
        "INSERT INTO job_count (shot_id, kind, state, num, wall_ms) VALUES (?, ?, ?, ?, ?) ON CONFLICT DO UPDATE SET "
        "num = num + excluded.num, wall_ms = wall_ms + excluded.wall_ms",
        shot.value, kind, to_string(state), difference.num, difference.wall_ms);
  }
  for (const auto& [class_id, num] : ready_)
    if (num != 0) db.run("UPDATE need_class SET num_ready = num_ready + ? WHERE id = ?", num, class_id);
  jobs_.clear();
  ready_.clear();
}

}  // namespace vantage
