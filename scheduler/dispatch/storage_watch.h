#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "schema/base/ids.h"

namespace vantage {

/// Whether results can be put into the shots' folders now. While they cannot, a shot's jobs wait: a full disk is
/// nobody's failure, and the other shots go on. The scheduler's thread only.
class StorageWatch {
 public:
  using FolderOf = std::function<std::filesystem::path(ShotId)>;  ///< a shot's folder
  explicit StorageWatch(FolderOf folder_of) : folder_of_(std::move(folder_of)) {}

  /// Why nothing can be put there, in one line; empty when all is well. Looks at most every two seconds, so that
  /// storage over a network is not asked for each job.
  const std::string& trouble(ShotId shot, std::int64_t now_ms);
  /// As trouble(), but looks now.
  const std::string& look(ShotId shot, std::int64_t now_ms);

 private:
  struct Seen {
    std::int64_t next_ms = 0;
    std::string trouble;
  };
  FolderOf folder_of_;
  std::map<ShotId, Seen> seen_;
};

}  // namespace vantage
