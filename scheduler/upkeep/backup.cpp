#include "scheduler/upkeep/backup.h"

#include <fmt/format.h>

#include "scheduler/farm/lock_file.h"
#include "scheduler/store/migrations.h"
#include "scheduler/store/sqlite.h"
#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

/// Workers heed no orders of an epoch before the last that they have seen, and the copy knows only those up to its
/// own. No farm starts so often between two backups.
constexpr std::int64_t kEpochLeap = 1'000'000;

/// What a farm needs besides its database. The key is for its owner only.
struct Setting {
  const char* name;
  unsigned mode;
};
constexpr Setting kSettings[] = {{"farm.toml", 0600}, {"farm.key", 0600}};

BackupFacts facts_of(Sqlite& db) {
  return {.farm_id = db.text_or("", "SELECT value FROM meta WHERE key = 'farm_id'"),
          .version = static_cast<int>(db.integer_or(0, "PRAGMA user_version")),
          .num_shots = db.integer_or(0, "SELECT count(*) FROM shot"),
          .num_jobs = db.integer_or(0, "SELECT count(*) FROM job"),
          .num_done = db.integer_or(0, "SELECT count(*) FROM job WHERE state IN ('done', 'skipped')")};
}

/// Throws unless the file may take a farm's place.
BackupFacts check_copy(const fs::path& file) {
  if (!fs::is_regular_file(file))
    throw Error(ErrorKind::BadInput, fmt::format("{}: no such copy of a farm's database", file.string()));
  Sqlite db(file, Sqlite::Mode::ReadOnly);
  if (const std::string why = db.why_damaged(); !why.empty())
    throw Error(ErrorKind::BadInput, fmt::format("{}: this copy is damaged: {}; choose another", file.string(), why));
  if (db.integer_or(0, "SELECT count(*) FROM sqlite_master WHERE name IN ('meta', 'shot', 'job')") != 3)
    throw Error(ErrorKind::BadInput, fmt::format("{}: is no copy of a farm's database", file.string()));
  const BackupFacts facts = facts_of(db);
  if (facts.version > all_migrations().back().version)
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: is of version {}, made by a newer vantage; this one knows versions up to {}",
                            file.string(), facts.version, all_migrations().back().version));
  return facts;
}

std::int64_t epoch_of(const fs::path& database) {
  try {
    return std::stoll(
        Sqlite(database, Sqlite::Mode::ReadOnly).text_or("0", "SELECT value FROM meta WHERE key = 'epoch'"));
  } catch (const std::exception&) {
    return 0;  // the database that is replaced may be beyond reading
  }
}

/// The database with its journal, which belongs to no other.
fs::path move_aside(const fs::path& database, std::int64_t wall_ms) {
  if (!fs::exists(database)) return {};
  const std::string aside = fmt::format("{}.replaced-{}", database.string(), wall_ms);
  for (const char* part : {"", "-wal", "-shm"})
    if (fs::exists(database.string() + part)) fs::rename(database.string() + part, aside + part);
  return aside;
}

void bring_settings(const fs::path& from, const fs::path& state_dir, Restored& done) {
  for (const auto& [name, mode] : kSettings) {
    if (!fs::exists(from / name)) continue;
    if (fs::exists(state_dir / name)) {
      done.settings_kept.emplace_back(name);
    } else {
      write_file_atomically(state_dir / name, read_file(from / name), mode);
      done.settings_restored.emplace_back(name);
    }
  }
}

}  // namespace

BackupFacts back_up(const fs::path& state_dir, const fs::path& to) {
  Sqlite db = open_farm_to_read(state_dir);
  if (fs::exists(to) && !fs::is_empty(to))
    throw Error(ErrorKind::BadInput, fmt::format("{}: is there already; a backup goes into a new folder", to.string()));
  fs::create_directories(to);
  fs::permissions(to, fs::perms::owner_all);
  for (const auto& [name, mode] : kSettings)
    if (fs::exists(state_dir / name)) write_file_atomically(to / name, read_file(state_dir / name), mode);
  db.copy_to(to / "farm.sqlite");  // last: a folder that has it is whole
  return check_copy(to / "farm.sqlite");
}

Restored restore(const fs::path& state_dir, const fs::path& from, std::int64_t wall_ms) {
  const bool is_folder = fs::is_directory(from);
  const fs::path file = is_folder ? from / "farm.sqlite" : from;
  Restored done{.facts = check_copy(file), .replaced = {}, .settings_kept = {}, .settings_restored = {}};
  fs::create_directories(state_dir);
  const LockFile lock(state_dir / "lock");
  const fs::path database = state_dir / "farm.sqlite", trial = database.string() + ".restoring";
  Sqlite(file, Sqlite::Mode::ReadOnly).copy_to(trial);
  const std::int64_t epoch = std::max(epoch_of(trial), epoch_of(database)) + kEpochLeap;
  {
    Sqlite db(trial, Sqlite::Mode::ReadWrite);
    db.run("INSERT OR REPLACE INTO meta (key, value) VALUES ('epoch', ?)", std::to_string(epoch));
  }
  done.replaced = move_aside(database, wall_ms);
  fs::rename(trial, database);
  fsync_path(state_dir);
  if (is_folder) bring_settings(from, state_dir, done);
  return done;
}

}  // namespace vantage
