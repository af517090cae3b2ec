#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// Depth of one image along its optical axis.
struct DepthJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() { return {.name = "depth", .version = 1, .reads = "correspondences of an image, poses", .publishes = "depth, confidence"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
