#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// Moving surface patches from one group of images.
struct ReconstructJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() { return {.name = "reconstruct", .version = 1, .reads = "images of a group, poses, times", .publishes = "patches"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
