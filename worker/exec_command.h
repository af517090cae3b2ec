#pragma once
#include <filesystem>
#include <string>

#include "worker/fork_server.h"
#include "worker/worker_main.h"

namespace vantage {

/// `vantage-worker exec SPEC`: one job in this process.
struct ExecOptions {
  std::filesystem::path spec;
  std::string spec_hash;              ///< hash_file(spec) that the scheduler means; empty: any
  std::filesystem::path scratch_dir;  ///< empty: a new one, removed afterwards
  int cores = 0;                      ///< 0: as the spec says
};

/// Prints the artifact's folder; or, to stderr, one line of what is wrong. Returns 0, 1 failed, 2 bad input.
int run_exec_command(const ExecOptions& options, const WorkerProgram& program);

/// The same for a child of the fork server: progress and outcome go through its link.
int run_child(const ChildRequest& request, ChildLink& link, const WorkerProgram& program);

/// The job of an assignment without a job file. kind: "noop/1". Throws Error(Bug) for other text.
JobFile inline_job(const std::string& kind, const std::string& spec);

}  // namespace vantage
