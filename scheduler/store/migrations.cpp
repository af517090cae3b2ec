#include "scheduler/store/migrations.h"

#include <fmt/format.h>

#include "scheduler/store/snapshot_files.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// A check reads the whole file: what takes longer than a second is checked while the farm works (Damage check of the
/// scheduler), so that a farm of a million jobs is back at once.
constexpr std::uintmax_t kMaxBytesToCheck = 64U << 20U;

int version_of(Sqlite& db) { return static_cast<int>(db.integer_or(0, "PRAGMA user_version")); }

void check_health(Sqlite& db) {
  if (const std::string why = db.why_damaged(); !why.empty())
    throw Error(ErrorKind::Transient, fmt::format("{}: the database is damaged: {}{}", db.file().string(), why,
                                                  how_to_bring_back(db.file().parent_path())));
}

/// What the new version does not know to undo.
void snapshot(Sqlite& db, int version) { db.copy_to(snapshot_before_version(db.file(), version)); }

}  // namespace

void migrate(Sqlite& db, const std::vector<Migration>& migrations) {
  const int newest = migrations.back().version;
  const int found = version_of(db);
  if (found > newest)
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: is of version {}, made by a newer vantage; this one knows versions up to {}",
                            db.file().string(), found, newest));
  if (std::filesystem::file_size(db.file()) <= kMaxBytesToCheck) check_health(db);
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
