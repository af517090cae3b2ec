#pragma once
#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <string>

namespace vantage {

/// A scheduler in a process of its own, which plans the probe kinds: to be measured, and to be killed. The caller's
/// process must have one thread only and hold no database open whenever start() is called: it forks.
class BenchScheduler {
 public:
  BenchScheduler(std::filesystem::path state_dir, int lease_ms);
  ~BenchScheduler() { kill(); }
  BenchScheduler(const BenchScheduler&) = delete;
  BenchScheduler& operator=(const BenchScheduler&) = delete;

  /// Returns when it serves. Throws Error(Resource) with what it said when it does not come up.
  void start();
  /// kill -9
  void kill();
  /// Returns when the plan is committed. Throws as FarmScheduler::submit().
  void submit(const std::filesystem::path& shot);

  const std::filesystem::path& state_dir() const { return state_dir_; }
  const std::string& bus_url() const { return bus_url_; }
  std::filesystem::path key_file() const { return state_dir_ / "farm.key"; }
  std::int64_t cpu_ms() const;       ///< of all its threads since its start
  std::int64_t peak_rss_mb() const;  ///< since its start

 private:
  [[noreturn]] void serve(int fd) const;
  std::string ask(const std::string& line);

  std::filesystem::path state_dir_;
  int lease_ms_, broker_port_ = 0;  ///< port: the same after a restart, so that workers find it
  std::string bus_url_;
  pid_t pid_ = -1;
  int fd_ = -1;  ///< lines: a shot's folder there, an answer back
};

}  // namespace vantage
