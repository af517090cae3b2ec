/// Sqlite: copies of a database that others write to meanwhile.
#include <fmt/format.h>
#include <sqlite3.h>

#include "scheduler/store/sqlite.h"
#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

/// 4 MB of pages of 4 KB: how soon a copy heeds that it should stop.
constexpr int kPagesPerSlice = 1024;

struct CloseCopy {
  void operator()(sqlite3* db) const { sqlite3_close(db); }
};
using Copy = std::unique_ptr<sqlite3, CloseCopy>;

[[noreturn]] void fail(sqlite3* copy, int code, const fs::path& to) {
  const bool full = (code & 0xff) == SQLITE_FULL || (code & 0xff) == SQLITE_IOERR;
  throw Error(full ? ErrorKind::Resource : ErrorKind::Transient,
              fmt::format("{}: cannot be written: {}", to.string(),
                          copy != nullptr ? sqlite3_errmsg(copy) : sqlite3_errstr(code)));
}

Copy open_copy(const fs::path& to) {
  sqlite3* raw = nullptr;
  const int code = sqlite3_open_v2(to.c_str(), &raw, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
  Copy copy(raw);
  if (code != SQLITE_OK) fail(raw, code, to);
  // Nobody sees it before it is whole and synced.
  sqlite3_exec(raw, "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF", nullptr, nullptr, nullptr);
  return copy;
}

/// False when it was told to stop.
bool copy_pages(sqlite3* from, sqlite3* copy, const fs::path& to, const std::function<bool()>& go_on) {
  sqlite3_backup* backup = sqlite3_backup_init(copy, "main", from, "main");
  if (backup == nullptr) fail(copy, sqlite3_errcode(copy), to);
  int code = SQLITE_OK;
  bool wanted = true;
  while (wanted && code == SQLITE_OK) {
    code = sqlite3_backup_step(backup, kPagesPerSlice);
    wanted = !go_on || go_on();
  }
  sqlite3_backup_finish(backup);
  if (code == SQLITE_OK) return false;
  if (code != SQLITE_DONE) fail(copy, code, to);
  return true;
}

}  // namespace

std::string Sqlite::why_damaged() {
  try {
    const std::string verdict = text_or("", "PRAGMA quick_check(1)");
    return verdict == "ok" ? "" : verdict;
  } catch (const Error& e) {
    return e.what();
  }
}

bool Sqlite::copy_to(const fs::path& to, const std::function<bool()>& go_on) {
  const fs::path trial = to.string() + ".tmp";
  fs::remove(trial);
  bool whole = false;
  {
    const Copy copy = open_copy(trial);
    script("BEGIN; SELECT count(*) FROM sqlite_master");  // one state, whatever is written meanwhile
    try {
      whole = copy_pages(db_.get(), copy.get(), trial, go_on);
    } catch (...) {
      script("ROLLBACK");
      fs::remove(trial);
      throw;
    }
    script("ROLLBACK");
    // One file that is readable on its own: no journal beside it.
    sqlite3_exec(copy.get(), "PRAGMA journal_mode = DELETE", nullptr, nullptr, nullptr);
  }
  if (!whole) {
    fs::remove(trial);
    return false;
  }
  if (const std::string why = Sqlite(trial, Mode::ReadOnly).why_damaged(); !why.empty()) {
    fs::remove(trial);
    throw Error(ErrorKind::Transient, fmt::format("{}: the copy is damaged: {}", to.string(), why));
  }
  fsync_path(trial);
  fs::rename(trial, to);
  fsync_path(fs::absolute(to).parent_path());
  return true;
}

}  // namespace vantage
