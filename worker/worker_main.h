#pragma once
#include <functional>
#include <string>
#include <vector>

#include "worker/export_command.h"
#include "worker/run_table.h"

namespace vantage {

/// What makes one worker program differ from another: the jobs that it can do, and the libraries that they use.
struct WorkerProgram {
  RunTable runs;
  /// A program beside this one that has some of the kinds, and few libraries: forking a process with
  /// hundreds of them costs 10 ms of processor time, one with a few 0.5 ms. "": this program does them itself.
  std::string light_program = {};
  std::vector<std::string> light_kinds = {};  ///< what the light program can do, as kind_and_version() says it
  std::function<void(int cores)> limit_threads = [](int) {};
  /// `probe FILE…`, for programs that can read footage; returns the exit status. Empty: no such command.
  std::function<int(const std::vector<std::string>& footage, bool json)> probe = {};
  /// `points SHOT` and `mesh SHOT`, for programs that can read depth maps. Empty: no such commands.
  std::function<int(const ExportOptions&)> export_depth = {};
};

/// The whole of a worker's main(): serves a farm, or runs one of the commands `exec`, `kinds`, `probe`, `points`,
/// `mesh`. Returns the exit status: 0, 1 failed, 2 misuse. Must be called before any thread is made.
int worker_main(int argc, char** argv, const WorkerProgram& program);

}  // namespace vantage
