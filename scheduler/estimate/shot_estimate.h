#pragma once
/// Estimates of a shot as the database has it, through any connection.
#include <optional>
#include <string>
#include <vector>

#include "scheduler/estimate/critical_path.h"
#include "scheduler/estimate/estimate.h"
#include "scheduler/store/sqlite.h"
#include "schema/base/ids.h"

namespace vantage {

struct ShotEstimate {
  std::optional<Estimate> rest;  ///< empty: cannot be told, and `why` says why
  std::string why;
  struct PathJob {
    JobId id{};
    std::string name{}, state{};
  };
  std::vector<PathJob> critical_path;  ///< of what is planned and unfinished; empty when that is too much to look at
  double critical_path_s = 0;
};

/// kind_names: in the order of the pipeline. now_ms: wall clock. Takes up to 50 ms with 10,000 unfinished jobs.
/// Empty when there is no such shot, or when it has ended.
std::optional<ShotEstimate> estimate_shot(Sqlite& db, ShotId shot, const std::vector<std::string>& kind_names,
                                          std::int64_t now_ms);

}  // namespace vantage
