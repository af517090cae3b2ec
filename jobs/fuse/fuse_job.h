#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// One dynamic model from the patches of all groups: Klose et al. 2011, §6 and §7.
struct FuseJob {
  struct Params {
    double merge_distance = 0.5;
    double kappa = 0.5;
    int surface_depth = 9;
    int surface_trim = 7;
    void fields(auto&& field) {
      field("merge_distance", merge_distance, Range{0.0, 4.0},
            "patches of different groups nearer than this many patch spacings become one");
      field("kappa", kappa, Range{0.01, 4.0},
            "how near to each other's plane they must lie, in patch spacings (Eq. 9)");
      field("surface_depth", surface_depth, Range{4, 12},
            "octree depth of the surface: 2^depth cells along the longest side");
      field("surface_trim", surface_trim, Range{0, 12},
            "cut the surface where patches are sparser than this octree depth; 0: keep all");
    }
  };
  static KindSpec spec() {
    return {.name = "fuse",
            .version = 2,
            .reads = "patches of all groups, calibration",
            .publishes = "one model, points per time, surface",
            .programs = "colmap"};
  }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
