#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// Feature points of one camera, followed from frame to frame: the raw material of synchronisation (Klose et al. 2011,
/// §4.1). Only shots whose clocks are found from motion have these jobs.
struct TrackJob {
  struct Params {
    int window_px = 15;
    double max_forward_backward_px = 0.5;
    int max_background = 300;
    int max_moving = 700;
    int min_frames = 6;
    double min_motion_px = 3;

    void fields(auto&& field) {
      field("window_px", window_px, Range{5, 63}, "side of the window that the tracker matches");
      field("max_forward_backward_px", max_forward_backward_px, Range{0.05, 5},
            "a point followed there and back must return this close");
      field("max_background", max_background, Range{0, 10000}, "points followed at a time on the static scene");
      field("max_moving", max_moving, Range{10, 20000}, "points followed at a time where something moves");
      field("min_frames", min_frames, Range{3, 1000}, "shorter tracks are dropped");
      field("min_motion_px", min_motion_px, Range{0.2, 100}, "a track that moves less against the scene is static");
    }
  };
  static KindSpec spec() {
    return {.name = "track",
            .version = 2,
            .reads = "frames, calibration",
            .publishes = "feature trajectories, moving areas"};
  }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
