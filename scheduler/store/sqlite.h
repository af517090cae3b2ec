#pragma once
/// SQLite as values: a connection, a statement, a row. Throws Error: Resource when the disk is full, Transient when the
/// file is busy or unreadable, Bug for wrong SQL.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "schema/base/error.h"

struct sqlite3;
struct sqlite3_stmt;

namespace vantage {

/// The file cannot be read or written now: disk full, I/O error, locked by another program, read-only. The transaction
/// must be rolled back as a whole; it may succeed later.
class DatabaseError : public Error {
 public:
  using Error::Error;
};

/// A prepared statement with its values bound. Resets itself when it goes out of scope.
///
///   for (auto q = db.query("SELECT id, name FROM job WHERE state = ?", "ready"); q.step();)
///     use(q.integer(0), q.text(1));
class Query {
 public:
  Query(Query&& other) noexcept : statement_(std::exchange(other.statement_, nullptr)) {}
  Query(const Query&) = delete;
  Query& operator=(const Query&) = delete;
  Query& operator=(Query&&) = delete;
  ~Query();

  /// Moves to the next row; false after the last.
  bool step();
  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string text(int column) const;
  bool is_null(int column) const;

 private:
  friend class Sqlite;
  explicit Query(sqlite3_stmt* statement) : statement_(statement) {}
  void bind(int index, std::int64_t value);
  void bind(int index, double value);
  void bind(int index, std::string_view value);
  void bind(int index, std::nullptr_t);
  template <class T>
  void bind_any(int index, const T& value) {
    if constexpr (std::is_same_v<T, std::nullptr_t>)
      bind(index, nullptr);
    else if constexpr (std::is_integral_v<T>)
      bind(index, static_cast<std::int64_t>(value));
    else if constexpr (std::is_floating_point_v<T>)
      bind(index, static_cast<double>(value));
    else
      bind(index, std::string_view(value));
  }
  sqlite3_stmt* statement_;
};

/// One connection. One thread at a time. Statements are compiled once per SQL text and kept.
class Sqlite {
 public:
  enum class Mode {
    ReadWrite,  ///< made when missing; WAL, synchronous = FULL, foreign keys on: only the scheduler's one thread
    ReadOnly,   ///< query_only: everybody else; any number at once, also while the scheduler writes
  };
  Sqlite(const std::filesystem::path& file, Mode mode);
  ~Sqlite();
  Sqlite(Sqlite&&) noexcept;
  Sqlite& operator=(Sqlite&&) noexcept;

  /// One SQL text is in use by at most one Query at a time.
  template <class... Values>
  Query query(std::string_view sql, const Values&... values) {
    Query q = prepared(sql);
    int index = 0;
    (q.bind_any(++index, values), ...);
    return q;
  }
  /// Runs a statement to its end; returns the number of rows it changed.
  template <class... Values>
  std::int64_t run(std::string_view sql, const Values&... values) {
    {
      Query q = query(sql, values...);
      while (q.step()) continue;
    }
    return num_changes();
  }
  /// First column of the first row, or the fallback when there is no row.
  template <class... Values>
  std::int64_t integer_or(std::int64_t fallback, std::string_view sql, const Values&... values) {
    Query q = query(sql, values...);
    return q.step() ? q.integer(0) : fallback;
  }
  template <class... Values>
  std::string text_or(std::string fallback, std::string_view sql, const Values&... values) {
    Query q = query(sql, values...);
    return q.step() ? q.text(0) : fallback;
  }
  /// Ends the transaction without its changes; nothing when SQLite has ended it already, as it does on some errors.
  void roll_back();
  /// Several statements at once, without values: schema files, pragmas.
  void script(const std::string& sql);
  std::int64_t last_insert_id() const;
  /// Copies the database as it is now to one file, in slices and while others write; a ReadOnly connection disturbs
  /// nobody, and never checkpoints. The file has its name only when it is whole, checked and durable.
  /// go_on: asked after every slice; false ends it. Returns whether the copy was made.
  /// Throws Error(Resource) when the disk is full, Error(Transient) when source or copy cannot be read.
  bool copy_to(const std::filesystem::path& to, const std::function<bool()>& go_on = nullptr);
  /// What a quick check of all pages finds; empty when the database is sound.
  std::string why_damaged();
  /// Moves what was committed from the journal into the database and cuts the journal off, unless readers are in the
  /// way just now. Not within a transaction; only the one that writes.
  void checkpoint();
  /// Of the journal, on disk.
  std::uintmax_t journal_bytes() const;
  const std::filesystem::path& file() const { return file_; }

 private:
  Query prepared(std::string_view sql);
  std::int64_t num_changes() const;
  struct Close {
    void operator()(sqlite3* db) const;
  };
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  std::filesystem::path file_;
  std::unique_ptr<sqlite3, Close> db_;
  struct Hash {
    using is_transparent = void;
    std::size_t operator()(std::string_view text) const { return std::hash<std::string_view>{}(text); }
  };
  std::unordered_map<std::string, std::unique_ptr<sqlite3_stmt, Finalize>, Hash, std::equal_to<>>
      statements_;  // finalized before db_ closes
};

/// The read-only connection of the page and the command line: STATE/farm.sqlite.
/// Throws Error(BadInput) when there is no farm there.
Sqlite open_farm_to_read(const std::filesystem::path& state_dir);

}  // namespace vantage
