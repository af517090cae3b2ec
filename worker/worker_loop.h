#pragma once
#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

#include "worker/worker_main.h"

namespace vantage {

struct WorkerOptions {
  std::string bus_url;
  std::filesystem::path farm_key_file;
  std::filesystem::path state_dir;
  int slots = 1;
  std::string pool = "default";
  std::vector<std::string> tags;
  int cores = 0;            ///< 0: all this process may use
  int ram_mb = 0;           ///< 0: nine tenths of the machine's
  int stuck_after_s = 900;  ///< without progress and processor time
  pid_t parent_pid = 0;     ///< ends with this process; told, since asking for it may come after its death. 0: none
};

/// Serves a farm until told to stop: SIGTERM finishes what runs, a second SIGTERM or SIGINT stops it. Returns the exit
/// status. Throws Error(BadInput) for options that cannot work. Blocks signals of the calling thread: call it from
/// main, before other threads are made.
int run_worker(const WorkerOptions& options, const WorkerProgram& program);

}  // namespace vantage
