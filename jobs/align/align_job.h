#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// One clock per camera from all pair offsets.
struct AlignJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() { return {.name = "align", .version = 1, .reads = "all pair offsets", .publishes = "one clock per camera"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
