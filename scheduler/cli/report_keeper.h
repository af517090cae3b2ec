#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "scheduler/farm/progress.h"
#include "schema/base/clock.h"

namespace vantage {

/// Keeps SHOT/out/report.html up to date: when a shot ends, and now and then while it runs.
class ReportKeeper {
 public:
  ReportKeeper(std::filesystem::path state_dir, const Clock& clock) : state_dir_(std::move(state_dir)), clock_(clock) {}
  /// Call often. A report that cannot be written is a sentence in the answer, never the end of the run.
  std::vector<std::string> keep(const std::vector<ShotProgress>& shots);

 private:
  struct Written {
    std::int64_t next_ms = 0;
    std::int64_t generation = -1;  ///< whose end has been written
    int num_finished = -1;
  };
  void write(const ShotProgress& shot, Written& written);

  std::filesystem::path state_dir_;
  const Clock& clock_;
  std::map<std::int64_t, Written> written_;  ///< by shot
};

}  // namespace vantage
