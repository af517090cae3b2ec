#include <fmt/format.h>
#include <unistd.h>

#include "scheduler/farm/farm.h"
#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {
namespace {

/// A small shot's frames, correspondences and previews; below this the first job would already fail half-way.
constexpr std::uintmax_t kMinFreeDiskMb = 200;

}  // namespace

void check_store(const std::filesystem::path& shot_folder) {
  const auto store = shot_folder / ".vantage" / "store";
  std::error_code error;
  std::filesystem::create_directories(store, error);
  if (error)
    throw Error(ErrorKind::BadInput, fmt::format("{}: the store cannot be made: {}", store.string(), error.message()));
  const std::uintmax_t free_mb = free_disk_mb(store);
  if (free_mb < kMinFreeDiskMb)
    throw Error(ErrorKind::BadInput, fmt::format("{}: no disk space for the store: {} MB free, needs at least {} MB",
                                                 store.string(), free_mb, kMinFreeDiskMb));
  try {  // permissions, quotas, read-only file systems: only writing tells
    const auto probe = store / fmt::format(".probe.{}", getpid());
    write_file_atomically(probe, "probe\n");
    std::filesystem::remove(probe);
  } catch (const Error& e) {
    throw Error(ErrorKind::BadInput, fmt::format("{}: the store cannot be written: {}", store.string(), e.what()));
  }
}

}  // namespace vantage
