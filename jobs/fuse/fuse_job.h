#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// One dynamic model from the patches of all groups.
struct FuseJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() { return {.name = "fuse", .version = 1, .reads = "patches of all groups", .publishes = "one model, points per time, surface"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
