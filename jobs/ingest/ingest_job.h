#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// The pictures of one camera, numbered and time-stamped.
struct IngestJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() { return {.name = "ingest", .version = 1, .reads = "footage", .publishes = "frame table with time stamps, frames, audio envelope"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
