#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// How far one camera's clock is behind another's (Klose et al. 2011, §4). An answer that cannot be told from the data
/// is said to be undetermined, never guessed.
struct SyncJob {
  struct Params {
    std::string method = "motion";
    std::string coarse = "epipolar";
    std::string subframe = "epipolar";
    double max_offset_s = 10;
    double max_std_frames = 0.4;
    int min_tracks = 5;

    void fields(auto&& field) {
      field("method", method, OneOf{{"motion", "audio", "known"}},
            "motion: from things that move; audio: from sound; known: start_s of every camera");
      field("coarse", coarse, OneOf{{"epipolar", "codes"}},
            "frame-accurate step. epipolar: offset at which most tracks meet their epipolar lines (of cameras without "
            "poses: lines that are sought at each offset); codes: binary codes of extremal points");
      field("subframe", subframe, OneOf{{"epipolar", "joint", "fundamental", "mean"}},
            "subframe step. epipolar: robust fit with the calibrated cameras, joint where a pose is missing; joint: "
            "pose and clock together; fundamental: det M(a) = 0 from many nines of tracks, what most agree with; mean: "
            "mean of those roots, as first published (biased)");
      field("max_offset_s", max_offset_s, Range{0.01, 3600}, "first frames of two cameras lie at most this far apart");
      field("max_std_frames", max_std_frames, Range{0.01, 5}, "an offset less certain than this is undetermined");
      field("min_tracks", min_tracks, Range{2, 1000},
            "an offset that rests on fewer independent tracks is undetermined");
    }
  };
  static KindSpec spec() {
    return {.name = "sync",
            .version = 3,
            .reads = "trajectories, calibration, frames; or sound",
            .publishes = "time offset of a camera pair and its uncertainty"};
  }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
