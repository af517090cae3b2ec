#include "scheduler/dispatch/storage_watch.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kLookEveryMs = 2'000;
/// Work stops above nothing, so that logs and the results of what runs still fit, and goes on with some room.
constexpr std::uintmax_t kStopBelowMb = 64, kGoOnAboveMb = 128;

std::string find_trouble(const fs::path& folder, bool had_trouble) {
  std::error_code error;
  const fs::path ours = folder / ".vantage";
  const fs::path& place = fs::exists(ours, error) ? ours : folder;
  const auto space = fs::space(place, error);
  if (error) return fmt::format("{}: cannot be reached: {}", place.string(), error.message());
  const std::uintmax_t free_mb = space.available >> 20U, wanted_mb = had_trouble ? kGoOnAboveMb : kStopBelowMb;
  if (free_mb < wanted_mb)
    return fmt::format("{}: the disk is full, {} MB free: work goes on when {} MB are", place.string(), free_mb,
                       kGoOnAboveMb);
  if (access(place.c_str(), W_OK) != 0)
    return fmt::format("{}: cannot be written: {}: work goes on when it can", place.string(), std::strerror(errno));
  return "";
}

}  // namespace

const std::string& StorageWatch::trouble(ShotId shot, std::int64_t now_ms) {
  const auto found = seen_.find(shot);
  return found != seen_.end() && now_ms < found->second.next_ms ? found->second.trouble : look(shot, now_ms);
}

const std::string& StorageWatch::look(ShotId shot, std::int64_t now_ms) {
  Seen& seen = seen_[shot];
  seen.trouble = find_trouble(folder_of_(shot), !seen.trouble.empty());
  seen.next_ms = now_ms + kLookEveryMs;
  return seen.trouble;
}

}  // namespace vantage
