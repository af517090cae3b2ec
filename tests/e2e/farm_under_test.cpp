#include "tests/e2e/farm_under_test.h"

#include <fcntl.h>
#include <signal.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <memory>
#include <sstream>

#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage::e2e {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void become(const std::vector<std::string>& argv) {
  std::vector<char*> words;
  for (const auto& word : argv) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  execvp(words[0], words.data());
  _exit(127);
}

int exit_code_of(int status) { return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status); }

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

Ended run(const std::vector<std::string>& argv) {
  int pipe_ends[2];
  check(pipe(pipe_ends) == 0, "a pipe can be made");
  const pid_t pid = fork();
  if (pid == 0) {
    dup2(pipe_ends[1], STDOUT_FILENO);
    dup2(pipe_ends[1], STDERR_FILENO);
    close(pipe_ends[0]);
    close(pipe_ends[1]);
    become(argv);
  }
  close(pipe_ends[1]);
  Ended ended;
  char buffer[4096];
  for (ssize_t n = 0; (n = read(pipe_ends[0], buffer, sizeof buffer)) > 0;)
    ended.output.append(buffer, static_cast<std::size_t>(n));
  close(pipe_ends[0]);
  int status = 0;
  waitpid(pid, &status, 0);
  ended.exit_code = exit_code_of(status);
  return ended;
}

Running::Running(const std::vector<std::string>& argv, const fs::path& output_file) : pid_(fork()) {
  if (pid_ != 0) return;
  setpgid(0, 0);
  const int out = open(output_file.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  dup2(out, STDOUT_FILENO);
  dup2(out, STDERR_FILENO);
  become(argv);
}

Running::~Running() {
  if (!reaped_) {
    kill(-pid_, SIGKILL);
    kill(pid_, SIGKILL);
    wait();
  }
}

bool Running::ended() {
  if (!reaped_ && waitpid(pid_, &status_, WNOHANG) == pid_) reaped_ = true;
  return reaped_;
}

int Running::wait() {
  if (!reaped_) {
    waitpid(pid_, &status_, 0);
    reaped_ = true;
  }
  return exit_code_of(status_);
}

std::vector<pid_t> children_of(pid_t parent) {
  std::vector<pid_t> children;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream stat(entry.path() / "stat");
    std::ostringstream text;
    text << stat.rdbuf();
    const std::size_t after_name = text.str().rfind(')');
    if (after_name == std::string::npos) continue;  // the process has ended meanwhile
    std::istringstream fields(text.str().substr(after_name + 1));
    std::string state;
    pid_t its_parent = 0;
    fields >> state >> its_parent;
    if (its_parent == parent && state != "Z") children.push_back(std::stoi(name));
  }
  return children;
}

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
