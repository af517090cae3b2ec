#pragma once
/// A farm's state folder, taken away and brought back.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace vantage {

struct BackupFacts {
  std::string farm_id;
  int version = 0;  ///< of the schema
  std::int64_t num_shots = 0, num_jobs = 0, num_done = 0;
};

/// Copies database, farm.toml and farm.key of a farm, which may be running, to a new folder.
/// Throws Error(BadInput) when `to` is there and not empty, or there is no farm.
BackupFacts back_up(const std::filesystem::path& state_dir, const std::filesystem::path& to);

struct Restored {
  BackupFacts facts;
  std::filesystem::path replaced;  ///< where the old database lies now; empty when there was none
  std::vector<std::string> settings_kept, settings_restored;  ///< farm.toml, farm.key
};

/// Puts a copy in the place of the farm's database. from: a folder that back_up() made, or one database file. Checks
/// it first; keeps what it replaces. Settings and key come back only where the farm has none.
/// Throws Error(BadInput) when a scheduler runs there, the copy is damaged, of a newer version, or of no farm.
Restored restore(const std::filesystem::path& state_dir, const std::filesystem::path& from, std::int64_t wall_ms);

}  // namespace vantage
