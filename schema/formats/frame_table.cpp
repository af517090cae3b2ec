#include "schema/formats/frame_table.h"

#include <fmt/format.h>

#include "schema/base/json.h"

namespace vantage {

FrameTable read_frame_table(const std::filesystem::path& ingest_artifact) {
  const Json j = read_json(ingest_artifact / "frames.json");
  return {j.at("camera"), j.at("width"), j.at("height"), j.at("fps"), j.at("pts_s").get<std::vector<double>>()};
}

void write_frame_table(const std::filesystem::path& file, const FrameTable& t) {
  write_json(file,
             {{"camera", t.camera}, {"width", t.width}, {"height", t.height}, {"fps", t.fps}, {"pts_s", t.pts_s}});
}

std::filesystem::path frame_path(const std::filesystem::path& ingest_artifact, int frame) {
  return ingest_artifact / fmt::format("frames/{:06d}.png", frame);
}

}  // namespace vantage
