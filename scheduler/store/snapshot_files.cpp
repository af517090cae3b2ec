#include "scheduler/store/snapshot_files.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <time.h>

#include <algorithm>

#include "scheduler/store/sqlite.h"
#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr const char* kNameFormat = "farm-%Y%m%dT%H%M%SZ.sqlite";

std::optional<std::int64_t> time_in_name(const std::string& name) {
  std::tm utc{};
  const char* rest = strptime(name.c_str(), kNameFormat, &utc);
  if (rest == nullptr || *rest != '\0') return std::nullopt;
  return static_cast<std::int64_t>(timegm(&utc)) * 1000;
}

std::int64_t changed_ms(const fs::path& path) {
  struct stat info {};
  return stat(path.c_str(), &info) == 0 ? static_cast<std::int64_t>(info.st_mtime) * 1000 : 0;
}

}  // namespace

bool is_sound_database(const fs::path& file) {
  try {
    return Sqlite(file, Sqlite::Mode::ReadOnly).why_damaged().empty();
  } catch (const Error&) {
    return false;  // not even a database
  }
}

fs::path snapshot_at(const fs::path& state_dir, std::int64_t wall_ms) {
  return state_dir / "snapshots" /
         fmt::format("farm-{:%Y%m%dT%H%M%SZ}.sqlite", fmt::gmtime(static_cast<std::time_t>(wall_ms / 1000)));
}

fs::path snapshot_before_version(const fs::path& database, int version) {
  return fmt::format("{}.before-{}", database.string(), version);
}

std::vector<SnapshotFile> list_snapshots(const fs::path& state_dir) {
  std::vector<SnapshotFile> files;
  std::error_code none_yet;
  for (const auto& entry : fs::directory_iterator(state_dir / "snapshots", none_yet))
    if (const auto at_ms = time_in_name(entry.path().filename().string())) files.push_back({entry.path(), *at_ms});
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.at_ms > b.at_ms; });
  return files;
}

std::optional<SnapshotFile> newest_sound_snapshot(const fs::path& state_dir) {
  auto files = list_snapshots(state_dir);
  std::error_code unreadable;
  for (const auto& entry : fs::directory_iterator(state_dir, unreadable))
    if (entry.path().filename().string().starts_with("farm.sqlite.before-"))
      files.push_back({entry.path(), changed_ms(entry.path())});
  std::stable_sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.at_ms > b.at_ms; });
  const auto sound =
      std::find_if(files.begin(), files.end(), [](const auto& file) { return is_sound_database(file.path); });
  return sound == files.end() ? std::nullopt : std::optional(*sound);
}

std::string how_to_bring_back(const fs::path& state_dir) {
  const auto copy = newest_sound_snapshot(state_dir);
  if (!copy)
    return fmt::format(
        "; there is no sound copy of it. Move the file away and submit the shots again: finished results "
        "are found by their keys");
  return fmt::format("; the newest sound copy is of {:%F %T} UTC: vantage restore --state '{}' '{}'",
                     fmt::gmtime(static_cast<std::time_t>(copy->at_ms / 1000)), state_dir.string(),
                     copy->path.string());
}

}  // namespace vantage
