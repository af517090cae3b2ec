#pragma once
#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "schema/base/clock.h"

namespace vantage {

/// The vantage-worker processes of `vantage run`: started, restarted when they die, stopped at the end. Each has a
/// process group of its own, so that Ctrl-C reaches only us, and dies with us whatever happens.
/// All members on one thread, which must live as long as the workers: they die with the thread that started them.
class WorkerPool {
 public:
  struct Options {
    std::filesystem::path program;
    std::string bus_url;
    std::filesystem::path key_file;
    std::filesystem::path folder;  ///< worker-<n>/ and worker-<n>.log go here
    int num_workers = 1;
    int ram_mb = 0;  ///< each may use
  };
  WorkerPool(Options options, const Clock& clock);
  ~WorkerPool();  ///< as stop(0)
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  /// Starts again what has died; returns a sentence for each. Throws Error(Resource) when workers keep dying at once.
  std::vector<std::string> mend();
  std::vector<pid_t> pids() const;
  /// Asks all to stop, waits, then kills what is left.
  void stop(int patience_ms);

 private:
  struct Worker {
    pid_t pid = -1;
    std::int64_t started_ms = 0;
    int num_early_deaths = 0;
  };
  void start(std::size_t index);
  std::filesystem::path log_file(std::size_t index) const;
  bool reap(Worker& worker) const;

  Options options_;
  const Clock& clock_;
  std::vector<Worker> workers_;
};

}  // namespace vantage
