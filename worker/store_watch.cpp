#include "worker/store_watch.h"

#include <fmt/format.h>
#include <sys/statvfs.h>

#include <algorithm>

namespace vantage {
namespace {

constexpr std::size_t kMaxStores = 8;
/// Enough for the manifests and logs of what runs; jobs that make more fail by themselves and say why.
constexpr std::uintmax_t kLeastFreeMb = 32;

std::string trouble_at(const std::filesystem::path& folder) {
  struct statvfs info {};
  if (statvfs(folder.c_str(), &info) != 0) return "";  // not there (yet): its jobs will say so
  if ((info.f_flag & ST_RDONLY) != 0) return fmt::format("{} is on a file system that is read-only", folder.string());
  const std::uintmax_t free_mb = std::uintmax_t{info.f_bavail} * info.f_frsize >> 20U;
  return free_mb < kLeastFreeMb ? fmt::format("no disk space left at {}: {} MB", folder.string(), free_mb) : "";
}

}  // namespace

void StoreWatch::learn(const std::filesystem::path& folder) {
  if (folder.empty() || std::find(stores_.begin(), stores_.end(), folder) != stores_.end()) return;
  stores_.push_back(folder);
  if (stores_.size() > kMaxStores) stores_.pop_front();
}

std::string StoreWatch::trouble() const {
  for (const auto& store : stores_)
    if (std::string found = trouble_at(store); !found.empty()) return found;
  return "";
}

}  // namespace vantage
