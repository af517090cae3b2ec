#pragma once
#include <filesystem>
#include <string>

#include "schema/formats/manifest.h"

namespace vantage {

/// STORE/.tmp/<key>.<host>.<pid>.<random>: where an artifact grows. On the store's own file system, so that one rename
/// commits it. Removed with all its contents unless it was committed.
class PrivateFolder {
 public:
  PrivateFolder(const std::filesystem::path& store, const std::string& key);
  ~PrivateFolder();
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Removes private folders that the process `pid` of this host left behind; with pid 0, those of `key` left by any
/// process of this host that has ended.
void remove_private_folders_of(const std::filesystem::path& store, const std::string& key, int pid);

/// Makes everything durable, then renames the folder, whose manifest is written, to its final name.
/// False when somebody else was first with a valid artifact: theirs stays, and ours is still where it was.
/// Throws Error(Resource) when the disk is full, Error(Transient) for other trouble with storage.
bool commit_artifact(const std::filesystem::path& folder, const std::filesystem::path& final_folder);

}  // namespace vantage
