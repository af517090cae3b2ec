#pragma once
#include <deque>
#include <filesystem>
#include <string>

namespace vantage {

/// Whether the stores that this worker writes to can take results.
class StoreWatch {
 public:
  /// A store or any folder in it, learned from a job.
  void learn(const std::filesystem::path& folder);
  /// One line, the first trouble found: "no disk space left at /store: 12 MB"; "" = none.
  std::string trouble() const;

 private:
  std::deque<std::filesystem::path> stores_;  ///< the most recent ones
};

}  // namespace vantage
