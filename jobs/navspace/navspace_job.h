#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// The recorded images as a space of azimuth, elevation and time.
struct NavspaceJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() { return {.name = "navspace", .version = 1, .reads = "calibration, clocks", .publishes = "vertices, simplices, edges"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
