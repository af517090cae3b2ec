#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// Feature points of one camera, followed from frame to frame.
struct TrackJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() { return {.name = "track", .version = 1, .reads = "frames", .publishes = "feature trajectories"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
