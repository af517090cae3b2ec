#pragma once
#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// How the film of a stereo render shows its eyes.
inline constexpr const char* kFilmLayout = "side_by_side";

/// A film of rendered frames, in several forms.
struct EncodeJob {
  struct Params {
    int crf = 18;
    std::string preset = "medium";
    int bits = 8;
    bool prores = false;
    std::vector<std::string> stereo = {"side_by_side", "anaglyph"};
    std::string background = "#000000";
    void fields(auto&& field) {
      field("crf", crf, Range{0, 51}, "H.264 quality: 0 lossless, 18 visually so, 51 worst");
      field("preset", preset, OneOf{{"ultrafast", "veryfast", "fast", "medium", "slow"}}, "H.264 effort");
      field("bits", bits, Range{8, 10}, "H.264 bits a channel: 8, or 10 (made from the linear EXR frames)");
      field("prores", prores, Any{}, "also ProRes 422 HQ (10 bit, .mov) of the film, for editors");
      field("stereo", stereo,
            OneOf{{"side_by_side", "side_by_side_half", "over_under", "over_under_half", "anaglyph", "left", "right"}},
            "films of two eyes; half: squeezed into the size of one");
      field("background", background, Any{}, "colour behind frames that are see-through, e.g. #20a040");
    }
  };
  static KindSpec spec() {
    return {.name = "encode",
            .version = 3,
            .reads = "rendered frames",
            .publishes = "films: mp4, ProRes; for stereo also side by side, over under, anaglyph, depth budget",
            .programs = "ffmpeg"};
  }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

}  // namespace vantage
