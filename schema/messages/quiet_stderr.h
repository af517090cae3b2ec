#pragma once
#include <mutex>

namespace vantage {

/// While it lives, holds back what the process writes to stderr; then writes it, less the lines that start with
/// `prefix`. For a library that prints where it should return. Short stretches only: a crash in between loses the
/// lines.
class QuietStderr {
 public:
  QuietStderr();
  ~QuietStderr();
  QuietStderr(const QuietStderr&) = delete;
  QuietStderr& operator=(const QuietStderr&) = delete;

 private:
  std::unique_lock<std::mutex> one_at_a_time_;
  int held_fd_ = -1;    ///< memory file that stands in for stderr
  int stderr_fd_ = -1;  ///< the real one, meanwhile
};

}  // namespace vantage
