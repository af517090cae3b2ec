#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// The pictures of one camera, numbered and time-stamped: frames.json, frames/%06d.png, audio.json where there is
/// sound.
struct IngestJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() {
    return {.name = "ingest",
            .version = 3,
            .reads = "footage",
            .publishes = "frame table with time stamps, frames, audio envelope",
            .programs = "ffmpeg ffprobe"};
  }
  /// Every camera's footage and mask must exist: throws Error(BadInput) with the line of shot.toml.
  static void check(const Shot& shot);
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

/// Files that `footage` names, in the order of their names: one file, or those that match a pattern with * ? [] in any
/// of its parts. Relative to `folder`. Empty when there is none.
std::vector<std::filesystem::path> footage_files(const std::filesystem::path& folder, const std::string& footage);
/// By its suffix: PNG, JPEG, TIFF, BMP, WebP or EXR.
bool is_still(const std::filesystem::path& file);

}  // namespace vantage
