#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "worker/execute_job.h"

namespace vantage {

/// `vantage-worker exec SPEC`: one job in this process. Files that are empty are not written.
struct ExecOptions {
  std::filesystem::path spec;
  std::string spec_hash;  ///< hash_file(spec) that the scheduler means; empty: any
  std::filesystem::path outcome_file;
  std::filesystem::path progress_file;
  std::filesystem::path scratch_dir;  ///< empty: a new one, removed afterwards
  int cores = 0;                      ///< 0: as the spec says
};

/// The runs of this program, and how many threads its libraries may use.
struct ExecEnvironment {
  std::function<const RunFunction&(const std::string& kind, int version)> find_run;
  std::function<void(int cores)> limit_threads;
};

/// Prints the artifact's folder; or, to stderr, one line of what is wrong. Returns 0, 1 failed, 2 bad input.
int run_exec_command(const ExecOptions& options, const ExecEnvironment& environment);

}  // namespace vantage
