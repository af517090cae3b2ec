#pragma once
#include <sys/types.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace vantage::e2e {

struct Ended {
  int exit_code = -1;  ///< 128 + signal when a signal ended it
  std::string output;  ///< stdout and stderr together
};

/// Runs a program to its end.
Ended run(const std::vector<std::string>& argv);

/// A program in the background, in a process group of its own.
class Running {
 public:
  Running(const std::vector<std::string>& argv, const std::filesystem::path& output_file);
  ~Running();  ///< kills the group if it still runs
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  pid_t pid() const { return pid_; }
  bool ended();
  /// Waits for the end; the exit code as in Ended.
  int wait();

 private:
  pid_t pid_ = -1;
  int status_ = -1;
  bool reaped_ = false;
};

/// Processes whose parent is `parent`.
std::vector<pid_t> children_of(pid_t parent);

/// Content hash of every finished job of a shot run by `vantage run`, by job name.
std::map<std::string, std::string> contents_by_job(const std::filesystem::path& shot);
/// How many attempts of each job ended as done.
std::map<std::string, int> done_attempts_by_job(const std::filesystem::path& shot);
/// Number of all attempts made so far.
int num_attempts(const std::filesystem::path& shot);
/// Kinds of the jobs with an attempt whose id is above `after`, each once.
std::vector<std::string> kinds_attempted_after(const std::filesystem::path& shot, int after);

/// Replaces the first occurrence of `from` in a text file; a failed expectation when there is none.
void edit(const std::filesystem::path& file, const std::string& from, const std::string& to);

}  // namespace vantage::e2e
