#pragma once
/// Copies of a farm's database and their names: STATE/snapshots/farm-<UTC time>.sqlite, and
/// STATE/farm.sqlite.before-<version> of a migration.
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vantage {

struct SnapshotFile {
  std::filesystem::path path;
  std::int64_t at_ms = 0;  ///< wall clock
};

/// STATE/snapshots/farm-20261122T101500Z.sqlite
std::filesystem::path snapshot_at(const std::filesystem::path& state_dir, std::int64_t wall_ms);
std::filesystem::path snapshot_before_version(const std::filesystem::path& database, int version);

/// The hourly ones, newest first.
std::vector<SnapshotFile> list_snapshots(const std::filesystem::path& state_dir);

/// A quick check of all pages finds nothing.
bool is_sound_database(const std::filesystem::path& file);
/// The newest copy of either sort that a quick check finds sound.
std::optional<SnapshotFile> newest_sound_snapshot(const std::filesystem::path& state_dir);

/// "; the newest sound copy is …: vantage restore …", or that there is none.
std::string how_to_bring_back(const std::filesystem::path& state_dir);

}  // namespace vantage
