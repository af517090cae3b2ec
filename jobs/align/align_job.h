#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// One clock per camera from all pair offsets, or from start_s when clocks are known. The first camera is the
/// reference: its offset is its start_s (default 0), its rate 1.
struct AlignJob {
  struct Params {
    double max_inconsistency_std = 4;
    double max_inconsistency_frames = 0.5;
    bool joint = false;

    void fields(auto&& field) {
      field("max_inconsistency_std", max_inconsistency_std, Range{1, 100},
            "a pair farther than this many standard deviations from what all others say is rejected");
      field("max_inconsistency_frames", max_inconsistency_frames, Range{0.05, 100}, "or farther than this many frames");
      field(
          "joint", joint, Any{},
          "clocks refined by bundle adjustment of the tracks that cameras share, with poses and background of an "
          "estimated calibration; static cameras, [sync] method = \"motion\". It took about half a minute and made the "
          "worst clock better, not always the median");
    }
  };
  static KindSpec spec() {
    return {.name = "align",
            .version = 3,
            .reads = "all pair offsets; tracks and calibration",
            .publishes = "one clock per camera"};
  }
  /// Throws Error(BadInput) when clocks are said to be known and a camera has no start_s.
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
