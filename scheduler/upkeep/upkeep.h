#pragma once
/// What a scheduler does beside its work: hourly copies of its database, old logs of attempts, a look at the disks,
/// and telling hooks. Threads of its own with read-only connections: the farm never waits for it.
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <thread>

#include "scheduler/farm/farm_config.h"
#include "scheduler/upkeep/notifier.h"

namespace vantage {

class Upkeep {
 public:
  struct Options {
    std::filesystem::path state_dir;
    FarmConfig config;
    /// Into the farm's trail of events; from any thread.
    std::function<void(const std::string& kind, const std::string& text)> note;
  };
  explicit Upkeep(Options options);
  /// Soon: a copy that is being made is given up.
  ~Upkeep() = default;
  Upkeep(const Upkeep&) = delete;
  Upkeep& operator=(const Upkeep&) = delete;

 private:
  void run(const std::stop_token& stop);
  void keep_snapshots(const std::stop_token& stop);
  void remove_old_logs();
  void look_at_disks();
  std::set<std::filesystem::path> running_shots() const;

  Options options_;
  std::int64_t next_snapshot_ms_ = 0, next_logs_ms_ = 0, next_disks_ms_ = 0;  ///< wall clock
  std::set<std::filesystem::path> told_low_;
  Notifier notifier_;
  std::jthread thread_;  // last: uses all of the above
};

}  // namespace vantage
