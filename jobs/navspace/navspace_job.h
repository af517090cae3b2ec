#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// The recorded images as a space of azimuth, elevation and time (Klose et al. 2011, §5.1).
struct NavspaceJob {
  struct Params {
    std::string cells = "auto";
    double arc_ratio = 0.15;
    void fields(auto&& field) {
      field("cells", cells, OneOf{{"auto", "columns", "delaunay"}},
            "columns: a triangulation of the cameras swept through time; delaunay: of all images; auto: columns unless "
            "every camera has one image");
      field("arc_ratio", arc_ratio, Range{0, 1},
            "cameras whose directions spread less than this across than along their main line count as an arc");
    }
  };
  static KindSpec spec() {
    return {.name = "navspace",
            .version = 2,
            .reads = "calibration, clocks, frame tables",
            .publishes = "vertices, simplices, edges"};
  }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
