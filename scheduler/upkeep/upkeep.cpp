#include "scheduler/upkeep/upkeep.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <condition_variable>
#include <mutex>

#include "scheduler/upkeep/garbage.h"
#include "scheduler/upkeep/snapshots.h"
#include "schema/base/clock.h"
#include "schema/base/files.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr auto kBeat = std::chrono::seconds(1);
constexpr std::int64_t kMinuteMs = 60'000, kDayMs = 86'400'000;
constexpr std::int64_t kLogsEveryMs = 60 * kMinuteMs, kDisksEveryMs = kMinuteMs / 2;
/// After a failure, e.g. of a full disk.
constexpr std::int64_t kTryAgainMs = 5 * kMinuteMs;

std::int64_t now_ms() { return system_clock().wall_ms(); }

/// A restart does not put off what was due.
std::int64_t first_snapshot_ms(const fs::path& state_dir, const FarmConfig::Snapshots& settings) {
  const auto files = list_snapshots(state_dir);
  return files.empty() ? now_ms() + settings.every_min * kMinuteMs
                       : files.front().at_ms + settings.every_min * kMinuteMs;
}

}  // namespace

Upkeep::Upkeep(Options options)
    : options_(std::move(options)),
      next_snapshot_ms_(first_snapshot_ms(options_.state_dir, options_.config.snapshots)),
      notifier_({.state_dir = options_.state_dir,
                 .hooks = options_.config.notify,
                 .on_trouble = [this](const std::string& sentence) { options_.note("warning", sentence); }}),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

void Upkeep::run(const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any wake_up;
  const auto when_due = [&](std::int64_t& next_ms, std::int64_t every_ms, const char* what, const auto& fn) {
    if (stop.stop_requested() || every_ms == 0 || now_ms() < next_ms) return;
    try {
      fn();
      next_ms = now_ms() + every_ms;
    } catch (const std::exception& e) {  // the thread's boundary: the farm goes on, and this is tried again
      spdlog::warn("{}: {}", what, e.what());
      options_.note("warning", fmt::format("{}: {}", what, e.what()));
      next_ms = now_ms() + kTryAgainMs;
    }
  };
  while (!stop.stop_requested()) {
    when_due(next_snapshot_ms_, options_.config.snapshots.every_min * kMinuteMs, "snapshot",
             [&] { keep_snapshots(stop); });
    when_due(next_logs_ms_, kLogsEveryMs, "old logs", [&] { remove_old_logs(); });
    when_due(next_disks_ms_, kDisksEveryMs, "disks", [&] { look_at_disks(); });
    std::unique_lock lock(mutex);
    wake_up.wait_for(lock, stop, kBeat, [] { return false; });
  }
}

void Upkeep::keep_snapshots(const std::stop_token& stop) {
  const std::int64_t start_ms = system_clock().monotonic_ms();
  const auto made = take_snapshot(options_.state_dir, now_ms(), [&] { return !stop.stop_requested(); });
  if (!made) return;
  spdlog::info("snapshot: {}, {:.1f} MB, in {} ms", made->string(), static_cast<double>(fs::file_size(*made)) / 1e6,
               system_clock().monotonic_ms() - start_ms);
  for (const SnapshotFile& old : superfluous(list_snapshots(options_.state_dir), options_.config.snapshots))
    fs::remove(old.path);
}

void Upkeep::remove_old_logs() {
  Sqlite db = open_farm_to_read(options_.state_dir);
  const Reach reach = reach_of_running(db);
  const FarmConfig::Logs& logs = options_.config.logs;
  const GarbageAges ages{.now_ms = now_ms(),
                         .keep_ms = 0,
                         .keep_logs_ms = logs.keep_days * kDayMs,
                         .max_log_bytes = static_cast<std::uintmax_t>(logs.attempts_max_mb) * 1'000'000};
  for (Query q = db.query("SELECT folder FROM shot"); q.step();)
    for (const Garbage& log : find_old_logs(q.text(0), reach, ages)) {
      std::error_code gone;
      fs::remove(log.path, gone);
    }
}

std::set<fs::path> Upkeep::running_shots() const {
  std::set<fs::path> shots;
  Sqlite db = open_farm_to_read(options_.state_dir);
  for (Query q = db.query("SELECT folder FROM shot WHERE state = 'running'"); q.step();)
    if (fs::is_directory(q.text(0))) shots.insert(q.text(0));
  return shots;
}

/// Once when it becomes low; again only after it was well.
void Upkeep::look_at_disks() {
  const auto low_mb = static_cast<std::uintmax_t>(options_.config.server.low_disk_mb);
  std::set<fs::path> places = running_shots();
  places.insert(options_.state_dir);
  for (const fs::path& place : places) {
    const std::uintmax_t free_mb = free_disk_mb(place);
    if (free_mb >= low_mb)
      told_low_.erase(place);
    else if (told_low_.insert(place).second)
      options_.note("warning", fmt::format("disk_low: {} has {} MB left; 'vantage gc' lists what may go",
                                           place.string(), free_mb));
  }
}

}  // namespace vantage
