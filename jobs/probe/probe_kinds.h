#pragma once
/// Kinds outside the pipeline, to measure and to check a farm. Workers can run them; a scheduler plans them only when
/// it was given them beside all_kinds().
#include "jobs/kind_entry.h"
#include "jobs/probe/noop_jobs.h"

namespace vantage {

using ProbeJobs = JobList<NoopJob, ProcessJob>;

const std::vector<KindEntry>& probe_kinds();

}  // namespace vantage
