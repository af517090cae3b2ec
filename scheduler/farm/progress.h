#pragma once
/// How far a shot is: what progress bars and the page draw.
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "schema/base/ids.h"

namespace vantage {

struct ShotProgress {
  struct Kind {
    std::string kind;
    std::map<std::string, int> num_by_state;  ///< by the words of job_state.h; states without jobs are left out
    int num_jobs = 0;
    int num_finished = 0;      ///< of those, jobs that will not run again
    std::int64_t wall_ms = 0;  ///< of finished jobs together
  };
  struct Running {
    JobId job;
    std::string name, worker, phase;
    double progress = 0;  ///< 0–1
  };
  struct Failure {
    std::string name, state, error_kind, error;
  };

  ShotId shot;
  std::string name;
  std::filesystem::path folder;
  std::string state;  ///< running, done, failed, paused
  std::string error;  ///< why the plan could not be completed
  std::int64_t generation = 0;
  std::vector<Kind> kinds;  ///< in the order of the pipeline; only kinds with jobs
  std::vector<Running> running;
  std::vector<Failure> failures;  ///< failed and quarantined jobs, not those aborted because of them
  int num_workers = 0;            ///< heard of within the lease

  bool finished() const { return state == "done" || state == "failed"; }
  int num_jobs() const;
  int num_finished() const;
};

}  // namespace vantage
