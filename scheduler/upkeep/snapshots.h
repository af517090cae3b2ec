#pragma once
/// Hourly copies of the database, and which of them are kept.
#include <functional>
#include <vector>

#include "scheduler/farm/farm_config.h"
#include "scheduler/store/snapshot_files.h"

namespace vantage {

/// Copies the database of a farm that may be running. Empty when go_on said stop.
std::optional<std::filesystem::path> take_snapshot(const std::filesystem::path& state_dir, std::int64_t wall_ms,
                                                   const std::function<bool()>& go_on);

/// Of files, newest first, those that may go: all but the newest of each of the last keep_hourly hours that have one,
/// and of each of the last keep_daily days that have one. The newest of all stays.
std::vector<SnapshotFile> superfluous(const std::vector<SnapshotFile>& files, const FarmConfig::Snapshots& keep);

}  // namespace vantage
