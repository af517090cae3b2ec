#pragma once
#include <string>
#include <vector>

#include "jobs/job_kind.h"
#include "worker/execute_job.h"

namespace vantage {

/// What this worker can do: the kinds of jobs/all_jobs.h and of jobs/probe/probe_kinds.h.
struct RunEntry {
  KindSpec spec;
  RunFunction run;
};
const std::vector<RunEntry>& run_table();

/// Throws Error(BadInput) for a kind that is not there (with a suggestion), Error(Transient) when this program has
/// another version of it than the job was planned for: another worker may have the right one.
const RunFunction& find_run(const std::string& kind, int version);

}  // namespace vantage
