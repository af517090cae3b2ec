#pragma once
#include <filesystem>
#include <string>

#include "worker/worker_main.h"

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

/// Prints the artifact's folder; or, to stderr, one line of what is wrong. Returns 0, 1 failed, 2 bad input.
int run_exec_command(const ExecOptions& options, const WorkerProgram& program);

}  // namespace vantage
