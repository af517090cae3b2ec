#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// One output frame.
struct RenderJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() { return {.name = "render", .version = 1, .reads = "simplex images and correspondences, or depth", .publishes = "view, or left and right eye"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
