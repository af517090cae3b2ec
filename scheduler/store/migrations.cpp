#include "scheduler/store/migrations.h"

#include <fmt/format.h>

#include <filesystem>

#include "schema/base/error.h"

namespace vantage {
namespace {

int version_of(Sqlite& db) { return static_cast<int>(db.integer_or(0, "PRAGMA user_version")); }

void check_health(Sqlite& db) {
  const std::string verdict = db.text_or("", "PRAGMA quick_check(1)");
  if (verdict != "ok")
    throw Error(ErrorKind::Transient, fmt::format("{}: the database is damaged: {}", db.file().string(), verdict));
}

/// VACUUM INTO makes one file without a journal, readable on its own.
void snapshot(Sqlite& db, int version) {
  const std::filesystem::path copy = fmt::format("{}.before-{}", db.file().string(), version);
  std::filesystem::remove(copy);  // of a migration that was interrupted
  db.run("VACUUM INTO ?", copy.string());
}

}  // namespace

void migrate(Sqlite& db, const std::vector<Migration>& migrations) {
  const int newest = migrations.back().version;
  const int found = version_of(db);
  if (found > newest)
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: is of version {}, made by a newer vantage; this one knows versions up to {}",
                            db.file().string(), found, newest));
  check_health(db);
  if (found > 0 && found < newest) snapshot(db, newest);
  for (const Migration& step : migrations) {
    if (step.version <= found) continue;
    db.script("BEGIN IMMEDIATE");
    try {
      db.script(std::string(step.sql));
      db.script(fmt::format("PRAGMA user_version = {}; COMMIT", step.version));
    } catch (...) {
      db.script("ROLLBACK");
      throw;
    }
  }
}

}  // namespace vantage
