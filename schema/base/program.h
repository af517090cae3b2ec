#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace vantage {

/// How a program is run.
struct ProgramOptions {
  std::filesystem::path stdout_file;  ///< empty: with stderr
  std::filesystem::path stderr_file;  ///< appended to; empty: our own stderr, which is a job's log
};

/// Runs argv[0] (looked up in PATH) to its end and returns its exit status; 128 + signal when a signal ended it. Its
/// standard input is empty, and it is killed when the calling thread ends, so no orphan goes on behind a killed job.
/// Throws Error(Resource) when the program is not installed or cannot be started.
int run_program(const std::vector<std::string>& argv, const ProgramOptions& options);

}  // namespace vantage
