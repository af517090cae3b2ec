#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// How far one camera's clock is behind another's.
struct SyncJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() { return {.name = "sync", .version = 1, .reads = "trajectories, calibration", .publishes = "time offset of a camera pair and its uncertainty"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
