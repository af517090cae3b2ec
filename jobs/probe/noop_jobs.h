#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// Jobs that do nothing, to measure what a farm itself costs: [noop] num_jobs = 10000 in a shot file.
struct NoopParams {
  int num_jobs = 0;
  void fields(auto&& field) { field("num_jobs", num_jobs, Range{0, 1'000'000}, "jobs that do nothing"); }
};

/// Runs inside the worker: the cost of dispatching alone.
struct NoopJob {
  using Params = NoopParams;
  static KindSpec spec() {
    return {.name = "noop", .version = 1, .reads = "nothing", .publishes = "", .in_worker = true};
  }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

/// Runs in a child process, as every job that makes something: dispatching, and a process per job.
struct ProcessJob {
  using Params = NoopParams;
  static KindSpec spec() { return {.name = "process", .version = 1, .reads = "nothing", .publishes = ""}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
