#include "scheduler/upkeep/collect.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include "scheduler/farm/turn_lock.h"
#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

fs::path trash_of(const fs::path& store) { return store / ".trash"; }

/// STORE/.gc.lock, released by the end of the process at the latest.
class CollectorLock {
 public:
  explicit CollectorLock(const fs::path& store)
      : fd_(open((store / ".gc.lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
    if (fd_ >= 0 && flock(fd_, LOCK_EX | LOCK_NB) == 0) return;
    if (fd_ >= 0) close(fd_);
    throw Error(
        ErrorKind::Transient,
        fmt::format("{}: cannot be locked: another 'vantage gc' works there, or it is read-only", store.string()));
  }
  ~CollectorLock() { close(fd_); }
  CollectorLock(const CollectorLock&) = delete;
  CollectorLock& operator=(const CollectorLock&) = delete;

 private:
  int fd_;
};

/// "<kind>.<key>": neither has a dot.
fs::path trash_place(const fs::path& store, const fs::path& artifact) {
  return trash_of(store) /
         fmt::format("{}.{}", artifact.parent_path().filename().string(), artifact.filename().string());
}

/// A newer one at its place wins: it is what workers have seen since.
void put_back(const fs::path& store, const fs::path& in_trash) {
  const std::string name = in_trash.filename().string();
  const auto dot = name.find('.');
  const fs::path place = dot == std::string::npos ? store / name : store / name.substr(0, dot) / name.substr(dot + 1);
  std::error_code error;
  fs::create_directories(place.parent_path());
  fs::rename(in_trash, place, error);
  if (error) fs::remove_all(in_trash);
}

/// False when it has vanished meanwhile.
bool take_away(const fs::path& store, const Garbage& garbage) {
  std::error_code error;
  if (garbage.what != Garbage::What::Artifact) return fs::remove_all(garbage.path, error) > 0 && !error;
  fs::rename(garbage.path, trash_place(store, garbage.path), error);
  return !error;
}

}  // namespace

void empty_trash_into_store(const fs::path& store) {
  if (!fs::is_directory(trash_of(store))) return;
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(trash_of(store))) left.push_back(entry.path());
  for (const fs::path& path : left) put_back(store, path);
}

Collected collect_garbage(const CollectOptions& options) {
  const CollectorLock lock(options.store);
  empty_trash_into_store(options.store);
  fs::create_directories(trash_of(options.store));
  Collected done;
  for (const Garbage& item : find_garbage(options.store, reach_of(options.store, options.state_dirs), options.ages))
    if (take_away(options.store, item)) done.removed.push_back(item);
  if (options.between) options.between();
  for (const fs::path& state_dir : options.state_dirs) TurnLock(state_dir).wait_for_turns_to_end();
  const Reach now = reach_of(options.store, options.state_dirs);
  std::erase_if(done.removed, [&](const Garbage& item) {
    if (item.what != Garbage::What::Artifact) return false;
    const fs::path in_trash = trash_place(options.store, item.path);
    const bool wanted =
        now.artifacts.contains(item.path.parent_path().filename().string() + "/" + item.path.filename().string());
    if (wanted)
      put_back(options.store, in_trash), done.put_back.push_back(item);
    else
      fs::remove_all(in_trash);
    return wanted;
  });
  fs::remove(trash_of(options.store));
  return done;
}

}  // namespace vantage
