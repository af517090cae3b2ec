#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "scheduler/farm/progress.h"
#include "scheduler/report/report.h"
#include "schema/base/json.h"

namespace vantage {

/// What a run has done, said at its end.
struct RunSummary {
  struct Failure {
    std::string job, state, error_kind, error;
    std::filesystem::path log;
  };
  std::string shot, state, error;
  double wall_s = 0;
  int num_jobs = 0;  ///< in the plan
  int num_good = 0;  ///< of those, with a result
  int num_run = 0;   ///< of those, made by this run; the others were up to date
  std::vector<Failure> failures;
  std::vector<JobWarning> warnings;
  std::vector<std::filesystem::path> results;  ///< the report, the films
};

/// start_wall_ms: when the run began, to tell what it made from what was there.
RunSummary summarize(const ShotProgress& progress, const std::filesystem::path& state_dir, std::int64_t start_wall_ms,
                     double wall_s);
std::string to_text(const RunSummary& summary);
Json to_json(const RunSummary& summary);
/// 0 all good, 2 when bad input was why something failed, 1 for any other failure.
int exit_code(const RunSummary& summary);

}  // namespace vantage
