#include "tests/e2e/farm_under_test.h"

#include <sqlite3.h>

#include <functional>
#include <memory>

#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage::e2e {
namespace fs = std::filesystem;
namespace {

/// Calls row(text of column 0, integer of column 1) for each row.
void query(const fs::path& shot, const std::string& sql, const std::function<void(const std::string&, int)>& row) {
  sqlite3* raw = nullptr;
  const fs::path file = shot / ".vantage/farm/farm.sqlite";
  const int opened = sqlite3_open_v2(file.c_str(), &raw, SQLITE_OPEN_READWRITE, nullptr);
  const std::unique_ptr<sqlite3, decltype(&sqlite3_close)> db(raw, &sqlite3_close);
  check(opened == SQLITE_OK, "the farm's database opens: " + file.string());
  sqlite3_busy_timeout(raw, 10000);
  sqlite3_stmt* statement = nullptr;
  check(sqlite3_prepare_v2(raw, sql.c_str(), -1, &statement, nullptr) == SQLITE_OK,
        std::string("the query is right: ") + sqlite3_errmsg(raw));
  const std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)> owner(statement, &sqlite3_finalize);
  while (sqlite3_step(statement) == SQLITE_ROW)
    row(reinterpret_cast<const char*>(sqlite3_column_text(statement, 0)), sqlite3_column_int(statement, 1));
}

}  // namespace

std::map<std::string, std::string> contents_by_job(const fs::path& shot) {
  std::map<std::string, std::string> contents;
  query(shot, "SELECT name || '=' || content, 0 FROM job WHERE state IN ('done', 'skipped')",
        [&](const std::string& text, int) {
          const std::size_t equals = text.find('=');
          contents[text.substr(0, equals)] = text.substr(equals + 1);
        });
  return contents;
}

std::map<std::string, int> done_attempts_by_job(const fs::path& shot) {
  std::map<std::string, int> counts;
  query(shot, "SELECT name, count(*) FROM attempt JOIN job ON job.id = job_id WHERE outcome = 'done' GROUP BY name",
        [&](const std::string& name, int count) { counts[name] = count; });
  return counts;
}

int num_attempts(const fs::path& shot) {
  int count = 0;
  query(shot, "SELECT '', coalesce(max(id), 0) FROM attempt", [&](const std::string&, int n) { count = n; });
  return count;
}

std::vector<std::string> kinds_attempted_after(const fs::path& shot, int after) {
  std::vector<std::string> kinds;
  query(shot,
        "SELECT kind, 0 FROM attempt JOIN job ON job.id = job_id WHERE attempt.id > " + std::to_string(after) +
            " GROUP BY kind ORDER BY kind",
        [&](const std::string& kind, int) { kinds.push_back(kind); });
  return kinds;
}

void edit(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = read_file(file);
  const std::size_t at = text.find(from);
  check(at != std::string::npos, "'" + from + "' is in " + file.string());
  text.replace(at, from.size(), to);
  write_file_atomically(file, text);
}

}  // namespace vantage::e2e
