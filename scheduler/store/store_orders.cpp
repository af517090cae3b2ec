/// Store: what people ordered that must outlive the scheduler.
#include "scheduler/store/store.h"

namespace vantage {

std::optional<ShotRow> Store::newest_shot() {
  const ShotId id{db_.integer_or(0, "SELECT id FROM shot ORDER BY state = 'running' DESC, submitted_ms DESC LIMIT 1")};
  return shot(id);
}

void Store::set_num_awaited(ShotId shot, int num) {
  db_.run("UPDATE shot SET num_awaited = ?1 WHERE id = ?2 AND num_awaited <> ?1", num, shot.value);
}

Store::StageSetting Store::stage_setting(ShotId shot, const std::string& kind) {
  Query q = db_.query("SELECT paused, priority FROM stage_setting WHERE shot_id = ? AND kind = ?", shot.value, kind);
  if (!q.step()) return {};
  return {.paused = q.integer(0) != 0,
          .priority = q.is_null(1) ? std::nullopt : std::optional(static_cast<int>(q.integer(1)))};
}

void Store::set_stage_setting(ShotId shot, const std::string& kind, const StageSetting& setting) {
  db_.run("INSERT OR REPLACE INTO stage_setting (shot_id, kind, paused) VALUES (?, ?, ?)", shot.value, kind,
          setting.paused ? 1 : 0);
  if (setting.priority)
    db_.run("UPDATE stage_setting SET priority = ? WHERE shot_id = ? AND kind = ?", *setting.priority, shot.value,
            kind);
}

std::optional<Store::Suspect> Store::suspect(ShotId shot, const std::string& kind, const std::string& key) {
  if (!has_suspects_) has_suspects_ = db_.integer_or(0, "SELECT EXISTS (SELECT 1 FROM suspect)") != 0;
  if (!*has_suspects_) return std::nullopt;
  Query q = db_.query("SELECT content, aside, who FROM suspect WHERE shot_id = ? AND kind = ? AND key = ?", shot.value,
                      kind, key);
  if (!q.step()) return std::nullopt;
  return Suspect{.content = q.text(0), .aside = q.text(1), .who = q.text(2)};
}

void Store::add_suspect(const JobRow& job, const std::string& who) {
  has_suspects_ = true;
  db_.run("INSERT OR REPLACE INTO suspect (shot_id, kind, key, content, who, asked_ms) VALUES (?, ?, ?, ?, ?, ?)",
          job.shot.value, job.kind, job.key, job.content, who, clock_.wall_ms());
}

void Store::set_suspect_aside(const JobRow& job, const std::string& folder) {
  db_.run("UPDATE suspect SET aside = ? WHERE shot_id = ? AND kind = ? AND key = ?", folder, job.shot.value, job.kind,
          job.key);
}

void Store::remove_suspect(ShotId shot, const std::string& kind, const std::string& key) {
  db_.run("DELETE FROM suspect WHERE shot_id = ? AND kind = ? AND key = ?", shot.value, kind, key);
}

}  // namespace vantage
