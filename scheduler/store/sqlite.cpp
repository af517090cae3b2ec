#include "scheduler/store/sqlite.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include "schema/base/error.h"

namespace vantage {
namespace {

/// The farm's thread must not stand still for long because another program holds the database.
constexpr int kWriterPatienceMs = 2'000, kReaderPatienceMs = 10'000;

ErrorKind kind_of(int code) {
  switch (code & 0xff) {
    case SQLITE_FULL:
    case SQLITE_NOMEM:
      return ErrorKind::Resource;
    case SQLITE_ERROR:
    case SQLITE_MISUSE:
    case SQLITE_RANGE:
    case SQLITE_MISMATCH:
    case SQLITE_CONSTRAINT:
      return ErrorKind::Bug;
    case SQLITE_NOTADB:
      return ErrorKind::BadInput;
    default:
      return ErrorKind::Transient;
  }
}

/// Nobody's mistake, and it may pass.
bool may_pass(int code) {
  switch (code & 0xff) {
    case SQLITE_FULL:
    case SQLITE_IOERR:
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_PROTOCOL:
    case SQLITE_NOMEM:
      return true;
    default:
      return false;
  }
}

[[noreturn]] void fail(sqlite3* db, int code, std::string_view doing) {
  const char* file = db != nullptr ? sqlite3_db_filename(db, "main") : nullptr;
  const std::string message = fmt::format("{}: {}: {}", file != nullptr ? file : "sqlite",
                                          db != nullptr ? sqlite3_errmsg(db) : sqlite3_errstr(code), doing);
  if (may_pass(code)) throw DatabaseError(kind_of(code), message);
  throw Error(kind_of(code), message);
}

void expect_ok(sqlite3_stmt* statement, int code) {
  if (code != SQLITE_OK) fail(sqlite3_db_handle(statement), code, sqlite3_sql(statement));
}

}  // namespace

Query::~Query() {
  if (statement_ == nullptr) return;
  sqlite3_reset(statement_);  // its code repeats what step() has thrown already
  sqlite3_clear_bindings(statement_);
}

bool Query::step() {
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  fail(sqlite3_db_handle(statement_), code, sqlite3_sql(statement_));
}

std::int64_t Query::integer(int column) const { return sqlite3_column_int64(statement_, column); }
double Query::real(int column) const { return sqlite3_column_double(statement_, column); }
bool Query::is_null(int column) const { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }
std::string Query::text(int column) const {
  const auto* text = sqlite3_column_text(statement_, column);
  const int num_bytes = sqlite3_column_bytes(statement_, column);
  return text == nullptr ? std::string()
                         : std::string(reinterpret_cast<const char*>(text), static_cast<std::size_t>(num_bytes));
}

void Query::bind(int index, std::int64_t value) { expect_ok(statement_, sqlite3_bind_int64(statement_, index, value)); }
void Query::bind(int index, double value) { expect_ok(statement_, sqlite3_bind_double(statement_, index, value)); }
void Query::bind(int index, std::nullptr_t) { expect_ok(statement_, sqlite3_bind_null(statement_, index)); }
void Query::bind(int index, std::string_view value) {
  expect_ok(statement_,
            sqlite3_bind_text(statement_, index, value.data(), static_cast<int>(value.size()), SQLITE_TRANSIENT));
}

void Sqlite::Close::operator()(sqlite3* db) const { sqlite3_close_v2(db); }
void Sqlite::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

Sqlite::Sqlite(const std::filesystem::path& file, Mode mode) : file_(file) {
  const int flags = mode == Mode::ReadWrite ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY;
  sqlite3* db = nullptr;
  const int code = sqlite3_open_v2(file.c_str(), &db, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  db_.reset(db);
  if (code != SQLITE_OK) fail(db, code, "open");
  sqlite3_busy_timeout(db, mode == Mode::ReadWrite ? kWriterPatienceMs : kReaderPatienceMs);
  if (mode == Mode::ReadWrite)
    script(
        "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON; PRAGMA wal_autocheckpoint = "
        "0; "
        "PRAGMA cache_size = -262144");  // KiB: the rows at work of a farm of a million jobs
  else
    script("PRAGMA query_only = ON");
}

Sqlite::~Sqlite() = default;
Sqlite::Sqlite(Sqlite&&) noexcept = default;
Sqlite& Sqlite::operator=(Sqlite&& other) noexcept {
  statements_ = std::move(other.statements_);  // before the connection that they belong to
  db_ = std::move(other.db_);
  file_ = std::move(other.file_);
  return *this;
}

Query Sqlite::prepared(std::string_view sql) {
  auto found = statements_.find(sql);
  if (found == statements_.end()) found = statements_.emplace(sql, nullptr).first;
  auto& slot = found->second;
  if (slot == nullptr) {
    sqlite3_stmt* statement = nullptr;
    const int code = sqlite3_prepare_v3(db_.get(), sql.data(), static_cast<int>(sql.size()), SQLITE_PREPARE_PERSISTENT,
                                        &statement, nullptr);
    if (code != SQLITE_OK) fail(db_.get(), code, sql);
    slot.reset(statement);
  }
  check(sqlite3_stmt_busy(slot.get()) == 0, "an SQL text is in use by one Query at a time");
  return Query(slot.get());
}

std::int64_t Sqlite::num_changes() const { return sqlite3_changes64(db_.get()); }
std::int64_t Sqlite::last_insert_id() const { return sqlite3_last_insert_rowid(db_.get()); }

void Sqlite::roll_back() {
  if (sqlite3_get_autocommit(db_.get()) == 0) script("ROLLBACK");
}

void Sqlite::checkpoint() {
  sqlite3_busy_timeout(db_.get(), 0);
  const int code = sqlite3_wal_checkpoint_v2(db_.get(), nullptr, SQLITE_CHECKPOINT_TRUNCATE, nullptr, nullptr);
  sqlite3_busy_timeout(db_.get(), kWriterPatienceMs);
  if (code != SQLITE_OK && code != SQLITE_BUSY) fail(db_.get(), code, "checkpoint");
}

std::uintmax_t Sqlite::journal_bytes() const {
  std::error_code none_yet;
  const auto bytes = std::filesystem::file_size(file_.string() + "-wal", none_yet);
  return none_yet ? 0 : bytes;
}

void Sqlite::script(const std::string& sql) {
  const int code = sqlite3_exec(db_.get(), sql.c_str(), nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail(db_.get(), code, sql.substr(0, 80));
}

Sqlite open_farm_to_read(const std::filesystem::path& state_dir) {
  const auto file = state_dir / "farm.sqlite";
  if (!std::filesystem::exists(file))
    throw Error(ErrorKind::BadInput, fmt::format("{}: there is no farm here", state_dir.string()));
  return Sqlite(file, Sqlite::Mode::ReadOnly);
}

}  // namespace vantage
