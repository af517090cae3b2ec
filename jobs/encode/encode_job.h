#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// A film of rendered frames.
struct EncodeJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() { return {.name = "encode", .version = 1, .reads = "rendered frames", .publishes = "mp4 preview, side-by-side, anaglyph"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
