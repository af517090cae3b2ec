#pragma once
/// The real program with real arguments.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <string>

namespace vantage {

struct Ended {
  int exit_code = -1;
  std::string output;  ///< stdout and stderr
};

/// Runs `vantage ARGUMENTS` by the shell, to its end.
inline Ended vantage(const std::string& arguments) {
  FILE* pipe = popen((std::string(VANTAGE_BIN) + "/vantage " + arguments + " 2>&1").c_str(), "r");
  Ended ended;
  char buffer[4096];
  for (std::size_t n = 0; (n = fread(buffer, 1, sizeof buffer, pipe)) > 0;) ended.output.append(buffer, n);
  ended.exit_code = WEXITSTATUS(pclose(pipe));
  return ended;
}

/// Exit code 2 and one line that says `part`.
inline void expect_misuse(const Ended& ended, const std::string& part) {
  EXPECT_EQ(ended.exit_code, 2) << ended.output;
  EXPECT_EQ(ended.output.rfind("vantage: ", 0), 0U) << ended.output;
  EXPECT_NE(ended.output.find(part), std::string::npos) << ended.output;
  EXPECT_EQ(std::count(ended.output.begin(), ended.output.end(), '\n'), 1) << ended.output;
}

}  // namespace vantage
