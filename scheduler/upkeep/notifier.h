#pragma once
/// Tells hooks what happened: each in a thread of its own, from a read-only connection, so that one that hangs holds up
/// neither the farm nor another. At least once: a hook's place in the trail of events is kept in
/// STATE/notify/<name>.json and moves on when the hook has taken an event, or has failed as often as farm.toml says.
#include <filesystem>
#include <functional>
#include <list>
#include <string>
#include <thread>

#include "scheduler/farm/farm_config.h"
#include "scheduler/upkeep/happenings.h"

namespace vantage {

/// Empty when the hook took it; else why not, in one line.
std::string tell(const FarmConfig::Notify& hook, const Json& facts);

class Notifier {
 public:
  struct Options {
    std::filesystem::path state_dir;
    std::vector<FarmConfig::Notify> hooks;
    std::function<void(const std::string& sentence)> on_trouble;  ///< from the hooks' threads
    int look_every_ms = 500;
    int first_pause_ms = 1000;  ///< after a failure; then twice as long each time, a minute at most
  };
  explicit Notifier(Options options);
  /// Waits for a hook that runs, no longer than its time-out.
  ~Notifier();
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

 private:
  void serve(const FarmConfig::Notify& hook, const std::stop_token& stop);
  std::int64_t first_cursor(const FarmConfig::Notify& hook, std::int64_t last) const;
  void tell_all(const FarmConfig::Notify& hook, Sqlite& db, std::int64_t& told_to, const std::stop_token& stop);
  /// Taken, or given up. False when the thread was asked to stop before: the event comes again after the next start.
  bool deliver(const FarmConfig::Notify& hook, const Happening& happening, const std::stop_token& stop);
  std::filesystem::path cursor_file(const FarmConfig::Notify& hook) const;

  Options options_;
  std::list<std::jthread> threads_;
};

}  // namespace vantage
