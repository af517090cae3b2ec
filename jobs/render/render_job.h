#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// One output frame (Klose et al. 2011, §5.2). Its options stand in its [[render]]: jobs/views/render_options.h.
struct RenderJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() {
    return {.name = "render",
            .version = 8,
            .reads = "images around the view, their correspondences and depth",
            .publishes = "view, or left and right eye"};
  }
  static void check(const Shot& shot);
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
