#include "scheduler/store/store.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>

#include "scheduler/store/migrations.h"
#include "scheduler/store/snapshot_files.h"
#include "schema/base/error.h"
#include "schema/base/hash.h"

namespace vantage {
namespace {

constexpr std::uintmax_t kMaxJournalBytes = 64U << 20U;
constexpr std::uintmax_t kMinJournalBytes = 1U << 20U;
constexpr std::int64_t kCheckpointMs = 15 * 60'000;

constexpr std::string_view kShotColumns = "id, folder, name, priority, state, until_kind, generation, error";

ShotRow shot_from(const Query& q) {
  return {.id = {q.integer(0)},
          .folder = q.text(1),
          .name = q.text(2),
          .priority = static_cast<int>(q.integer(3)),
          .state = q.text(4),
          .until_kind = q.text(5),
          .generation = q.integer(6),
          .error = q.text(7)};
}

/// Damage may be such that not even opening works.
Sqlite open_to_write(const std::filesystem::path& file) {
  try {
    return {file, Sqlite::Mode::ReadWrite};
  } catch (const Error& e) {
    if (!std::filesystem::exists(file) || is_sound_database(file)) throw;
    throw Error(e.kind(), e.what() + how_to_bring_back(file.parent_path()));
  }
}

}  // namespace

Store::Store(const std::filesystem::path& file, const Clock& clock) : db_(open_to_write(file)), clock_(clock) {
  migrate(db_, all_migrations());
}

void Store::begin() { db_.run("BEGIN IMMEDIATE"); }
void Store::commit() {
  tally_.write(db_);
  db_.run("COMMIT");
}
void Store::rollback() {
  forget_caches();
  tally_ = {};
  db_.roll_back();
}

/// On a small disk the journal must leave room for itself to be cut.
std::uintmax_t Store::max_journal_bytes() const {
  std::error_code unknown;
  const auto space = std::filesystem::space(db_.file().parent_path(), unknown);
  return unknown ? kMaxJournalBytes : std::clamp(space.available / 4, kMinJournalBytes, kMaxJournalBytes);
}

void Store::keep_journal_short() {
  const std::int64_t now_ms = clock_.monotonic_ms();
  if (db_.journal_bytes() < std::max(journal_mark_bytes_, max_journal_bytes()) &&
      now_ms - checkpoint_ms_ < kCheckpointMs)
    return;
  db_.checkpoint();
  checkpoint_ms_ = now_ms;
  journal_mark_bytes_ = db_.journal_bytes() + max_journal_bytes() / 4;  // a long reader: do not try after every commit
}

/// They may hold what was just undone.
void Store::forget_caches() {
  shots_.clear();
  class_ids_.clear();
  has_suspects_.reset();
}

void Store::guarded(const std::function<void()>& fn) {
  db_.run("SAVEPOINT guarded");
  const Tally before = tally_;
  try {
    fn();
  } catch (const DatabaseError&) {  // SQLite may have ended the transaction: all of it is to be rolled back
    throw;
  } catch (...) {
    tally_ = before;
    forget_caches();
    db_.run("ROLLBACK TO guarded");
    db_.run("RELEASE guarded");
    throw;
  }
  db_.run("RELEASE guarded");
}

std::string Store::meta(const std::string& key) { return db_.text_or("", "SELECT value FROM meta WHERE key = ?", key); }
void Store::set_meta(const std::string& key, const std::string& value) {
  db_.run("INSERT INTO meta (key, value) VALUES (?, ?) ON CONFLICT (key) DO UPDATE SET value = excluded.value", key,
          value);
}

ShotRow Store::submit_shot(const std::filesystem::path& folder, const std::string& name, const std::string& until_kind,
                           int priority) {
  shots_.clear();
  db_.run(
      "INSERT INTO shot (folder, name, priority, state, until_kind, generation, submitted_ms) "
      "VALUES (?, ?, ?, 'running', ?, 1, ?) ON CONFLICT (folder) DO UPDATE SET name = excluded.name, "
      "priority = excluded.priority, state = 'running', until_kind = excluded.until_kind, generation = generation + 1, "
      "error = '', submitted_ms = excluded.submitted_ms, finished_ms = NULL",
      folder.string(), name, priority, until_kind, clock_.wall_ms());
  const ShotId id{db_.integer_or(0, "SELECT id FROM shot WHERE folder = ?", folder.string())};
  db_.run("UPDATE job SET priority = ? WHERE shot_id = ?", priority, id.value);
  db_.run("DELETE FROM stage_setting WHERE shot_id = ?", id.value);
  tally_.write(db_);
  db_.run("DELETE FROM job_count WHERE shot_id = ?", id.value);  // nothing is of the new generation yet
  ShotRow row = *shot(id);
  add_event(id, std::nullopt, "", "submitted",
            until_kind.empty() ? fmt::format("generation {}", row.generation)
                               : fmt::format("generation {}, until {}", row.generation, until_kind));
  return row;
}

std::optional<ShotRow> Store::shot(ShotId id) {
  if (const auto cached = shots_.find(id); cached != shots_.end()) return cached->second;
  static const std::string sql = fmt::format("SELECT {} FROM shot WHERE id = ?", kShotColumns);
  Query q = db_.query(sql, id.value);
  return q.step() ? std::optional(shots_.insert_or_assign(id, shot_from(q)).first->second) : std::nullopt;
}

std::vector<ShotRow> Store::shots_in_state(const std::string& state) {
  static const std::string sql = fmt::format("SELECT {} FROM shot WHERE state = ? ORDER BY id", kShotColumns);
  std::vector<ShotRow> rows;
  for (Query q = db_.query(sql, state); q.step();) rows.push_back(shot_from(q));
  return rows;
}

void Store::set_shot_state(ShotId id, const std::string& state, const std::string& error) {
  shots_.erase(id);
  ++num_woken_;
  const bool finished = state == "done" || state == "failed";
  if (finished)
    db_.run("UPDATE shot SET state = ?, error = ?, finished_ms = ? WHERE id = ?", state, error, clock_.wall_ms(),
            id.value);
  else
    db_.run("UPDATE shot SET state = ?, error = ?, finished_ms = NULL WHERE id = ?", state, error, id.value);
  add_event(id, std::nullopt, "", "state", error.empty() ? state : state + ": " + error);
}

void Store::set_shot_priority(ShotId id, int priority) {
  shots_.erase(id);
  db_.run("UPDATE shot SET priority = ? WHERE id = ?", priority, id.value);
  db_.run("UPDATE job SET priority = ? WHERE shot_id = ?", priority, id.value);
}

void Store::add_event(std::optional<ShotId> shot, std::optional<JobId> job, const std::string& worker,
                      const std::string& kind, const std::string& text) {
  // One statement per combination would be four; NULL for 0 says the same in one.
  db_.run(
      "INSERT INTO event (at_ms, shot_id, job_id, worker_id, kind, text, who) VALUES (?, nullif(?, 0), nullif(?, 0), "
      "?, "
      "?, ?, ?)",
      clock_.wall_ms(), shot.value_or(ShotId{}).value, job.value_or(JobId{}).value, worker, kind, text, who_);
}

void Store::set_worker_state(const std::string& id, const std::string& state) {
  if (db_.run("UPDATE worker SET state = ? WHERE id = ? AND state <> ?", state, id, state) > 0)
    add_event(std::nullopt, std::nullopt, id, "worker", state);
}

std::optional<std::string> Store::worker_state(const std::string& id) {
  Query q = db_.query("SELECT state FROM worker WHERE id = ?", id);
  return q.step() ? std::optional(q.text(0)) : std::nullopt;
}

FileStamp Store::stamp_of(const std::filesystem::path& path) {
  struct stat info {};
  if (stat(path.c_str(), &info) != 0)
    throw Error(ErrorKind::BadInput, fmt::format("{}: there is no such file", path.string()));
  return {.size = info.st_size,
          .mtime_ns = std::int64_t{info.st_mtim.tv_sec} * 1'000'000'000 + info.st_mtim.tv_nsec,
          .inode = static_cast<std::int64_t>(info.st_ino)};
}

std::string Store::known_source_hash(const std::filesystem::path& path, const FileStamp& stamp) {
  return db_.text_or("", "SELECT hash FROM source_hash WHERE path = ? AND size = ? AND mtime_ns = ? AND inode = ?",
                     path.string(), stamp.size, stamp.mtime_ns, stamp.inode);
}

void Store::set_source_hash(const std::filesystem::path& path, const FileStamp& stamp, const std::string& hash) {
  db_.run("INSERT OR REPLACE INTO source_hash (path, size, mtime_ns, inode, hash) VALUES (?, ?, ?, ?, ?)",
          path.string(), stamp.size, stamp.mtime_ns, stamp.inode, hash);
}

}  // namespace vantage
