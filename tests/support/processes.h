#pragma once
#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace vantage {

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

/// Asks every few milliseconds until it is so; false when the time is over.
bool wait_until(const std::function<bool()>& is_so, double timeout_s);

}  // namespace vantage
