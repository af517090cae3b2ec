#pragma once
#include <filesystem>

namespace vantage {

/// Held by the one scheduler of a state folder, from construction to the end of the process at the latest: also
/// kill -9 releases it.
class LockFile {
 public:
  /// Throws Error(BadInput) naming the process that has it.
  explicit LockFile(const std::filesystem::path& path);
  ~LockFile();
  LockFile(const LockFile&) = delete;
  LockFile& operator=(const LockFile&) = delete;

 private:
  int fd_ = -1;
};

}  // namespace vantage
