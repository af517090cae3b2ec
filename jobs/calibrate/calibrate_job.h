#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// Where every camera was, and its lens.
struct CalibrateJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() { return {.name = "calibrate", .version = 1, .reads = "frames", .publishes = "COLMAP model: intrinsics, a pose per image, sparse points, undistortion"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
