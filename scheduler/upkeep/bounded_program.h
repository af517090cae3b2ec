#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace vantage {

struct BoundedRun {
  int exit_code = -1;      ///< 128 + signal when one ended it; 127 when it could not be started
  bool timed_out = false;  ///< and was killed with all that it had started
  std::string output;      ///< first 4 KB of stdout and stderr
  bool ok() const { return exit_code == 0 && !timed_out; }
};

/// Runs argv[0] (looked up in PATH) without a shell, with `input` on its standard input, for at most timeout_ms. Leaves
/// no process behind. Any thread.
BoundedRun run_bounded(const std::vector<std::string>& argv, std::string_view input, int timeout_ms);

}  // namespace vantage
