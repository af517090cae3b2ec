#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// Dense correspondences between two images.
struct CorrespondJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() { return {.name = "correspond", .version = 1, .reads = "two images, calibration", .publishes = "dense maps both ways, confidence, occlusion"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
