#include "scheduler/upkeep/snapshots.h"

#include <set>

#include "scheduler/store/sqlite.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kHourMs = 3'600'000, kDayMs = 86'400'000;

/// Is it the newest of its period, and its period among the newest `keep`? Files come newest first.
class Periods {
 public:
  Periods(std::int64_t length_ms, int keep) : length_ms_(length_ms), keep_(static_cast<std::size_t>(keep)) {}
  bool wants(const SnapshotFile& file) {
    const std::int64_t period = file.at_ms / length_ms_;
    return !seen_.contains(period) && seen_.size() < keep_ && seen_.insert(period).second;
  }

 private:
  std::int64_t length_ms_;
  std::size_t keep_;
  std::set<std::int64_t> seen_;
};

}  // namespace

std::optional<fs::path> take_snapshot(const fs::path& state_dir, std::int64_t wall_ms,
                                      const std::function<bool()>& go_on) {
  const fs::path to = snapshot_at(state_dir, wall_ms);
  fs::create_directories(to.parent_path());
  return open_farm_to_read(state_dir).copy_to(to, go_on) ? std::optional(to) : std::nullopt;
}

std::vector<SnapshotFile> superfluous(const std::vector<SnapshotFile>& files, const FarmConfig::Snapshots& keep) {
  Periods hours(kHourMs, keep.keep_hourly), days(kDayMs, keep.keep_daily);
  std::vector<SnapshotFile> gone;
  for (const SnapshotFile& file : files) {
    const bool of_hour = hours.wants(file), of_day = days.wants(file);
    if (!of_hour && !of_day) gone.push_back(file);
  }
  return gone;
}

}  // namespace vantage
