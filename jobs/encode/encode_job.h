#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// A film of rendered frames.
struct EncodeJob {
  struct Params {
    int crf = 18;
    std::string preset = "medium";
    void fields(auto&& field) {
      field("crf", crf, Range{0, 51}, "H.264 quality: 0 lossless, 18 visually so, 51 worst");
      field("preset", preset, OneOf{{"ultrafast", "veryfast", "fast", "medium", "slow"}}, "H.264 effort");
    }
  };
  static KindSpec spec() {
    return {.name = "encode",
            .version = 1,
            .reads = "rendered frames",
            .publishes = "mp4, for stereo side-by-side and anaglyph, too",
            .programs = "ffmpeg"};
  }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
