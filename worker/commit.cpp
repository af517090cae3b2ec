#include "worker/commit.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "worker/machine.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

fs::path temporary_folder(const fs::path& store) { return store / ".tmp"; }

fs::path unique_folder(const fs::path& store, const std::string& key) {
  return temporary_folder(store) / fmt::format("{}.{}.{}.{}", key, host_name(), getpid(), to_hex(random_bytes(4)));
}

/// The process that a name "<key>.<host>.<pid>.<random>" tells; 0 when it is no such name.
int pid_in(const std::string& name, const std::string& prefix) {
  int pid = 0;
  std::from_chars(name.data() + prefix.size(), name.data() + name.size(), pid);
  return pid;
}

void fsync_tree(const fs::path& folder) {
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() || entry.is_directory()) fsync_path(entry.path());
  fsync_path(folder);
}

/// What lies at the final name has no valid manifest: a damaged artifact must not block its repair.
void move_aside(const fs::path& store, const fs::path& damaged) {
  const fs::path aside = unique_folder(store, "damaged");
  if (rename(damaged.c_str(), aside.c_str()) != 0 && errno != ENOENT)
    throw Error(ErrorKind::Transient,
                fmt::format("{}: cannot move the damaged artifact away: {}", damaged.string(), std::strerror(errno)));
  std::error_code ignored;  // it is out of the way; `vantage gc` gets what could not be deleted
  fs::remove_all(aside, ignored);
}

}  // namespace

PrivateFolder::PrivateFolder(const fs::path& store, const std::string& key) : path_(unique_folder(store, key)) {
  fs::create_directories(path_);
}

PrivateFolder::~PrivateFolder() {
  std::error_code ignored;  // gone when committed; else a later attempt or `vantage gc` gets it
  fs::remove_all(path_, ignored);
}

void remove_private_folders_of(const fs::path& store, const std::string& key, int pid) {
  const std::string prefix = fmt::format("{}.{}.", key, host_name());
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(temporary_folder(store), error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix)) continue;
    const int owner = pid_in(name, prefix);
    const bool is_left_over = pid != 0 ? owner == pid : owner > 0 && kill(owner, 0) != 0 && errno == ESRCH;
    if (is_left_over) fs::remove_all(entry.path(), error);
  }
}

bool commit_artifact(const fs::path& folder, const fs::path& final_folder) {
  const fs::path kind_folder = final_folder.parent_path();
  fsync_tree(folder);
  fs::create_directories(kind_folder);
  for (int attempt = 0; attempt < 3; ++attempt) {
    if (rename(folder.c_str(), final_folder.c_str()) == 0) {
      fsync_path(kind_folder);
      fsync_path(kind_folder.parent_path());
      return true;
    }
    const int why = errno;
    if (why != ENOTEMPTY && why != EEXIST && why != ENOTDIR)
      throw Error(why == ENOSPC || why == EDQUOT ? ErrorKind::Resource : ErrorKind::Transient,
                  fmt::format("{}: cannot commit: {}", final_folder.string(), std::strerror(why)));
    if (read_valid_manifest(final_folder)) return false;
    move_aside(kind_folder.parent_path(), final_folder);
  }
  throw Error(ErrorKind::Transient,
              fmt::format("{}: somebody keeps putting damaged artifacts there", final_folder.string()));
}

}  // namespace vantage
