#pragma once
/// Dense correspondences along the edges of the navigation space: Klose et al. 2011, §5.1.
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// One edge of the navigation space, both ways: "correspond/cam0-000003__cam1-000004", the image with the smaller
/// vertex index first. Publishes forward.exr (first to second), backward.exr, preview.jpg. unit: {"first": label,
/// "second": label}.
struct CorrespondJob {
  struct Params {
    double consistent_px = 1.5;
    double max_stereo_megapixels = 0.6;
    int max_depths = 384;
    void fields(auto&& field) {
      field("consistent_px", consistent_px, Range{0.1, 100},
            "a match whose way there and back is longer counts as occluded");
      field("max_stereo_megapixels", max_stereo_megapixels, Range{0.01, 100},
            "larger pictures are matched along epipolar lines at half, quarter… size; motion is refined at full size");
      field("max_depths", max_depths, Range{16, 2048}, "depths tried per pixel; memory and time grow with it");
    }
  };
  static KindSpec spec() {
    return {.name = "correspond",
            .version = 7,
            .reads = "two images, calibration",
            .publishes = "dense maps both ways, confidence, occlusion"};
  }
  /// With [depth]: every matched edge (jobs/views/matched_edges.h). Else those that renders visit or that their depth
  /// maps are made from; with [correspond] and no render at all: every edge. What the first views read comes first.
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
