#include "jobs/mask_sources.h"

#include <fmt/format.h>

#include <algorithm>

#include "jobs/ingest/ingest_job.h"
#include "schema/base/error.h"
#include "schema/formats/footage_trim.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

std::string sequence_name(const std::string& camera, std::size_t index) {
  return fmt::format("mask/{}/{:06d}", camera, index);
}

std::vector<fs::path> mask_files(const Shot& shot, const ShotCamera& camera) {
  const auto fail = [&](const std::string& what) {
    throw Error(ErrorKind::BadInput,
                fmt::format("{}:{}: camera '{}' has mask {}, {}; expected a picture, or a pattern "
                            "of one picture per frame",
                            (shot.folder / "shot.toml").string(), camera.line, camera.name, camera.mask, what));
  };
  const auto files = footage_files(shot.folder, camera.mask);
  if (files.empty()) fail("which matches no file");
  const auto other = std::find_if_not(files.begin(), files.end(), is_still);
  if (other != files.end()) fail("of which " + other->filename().string() + " is not a picture");
  return files;
}

}  // namespace

std::vector<Source> mask_sources(const Shot& shot, const ShotCamera& camera) {
  if (camera.mask.empty()) return {};
  const auto files = mask_files(shot, camera);
  if (files.size() == 1) return {{"mask/" + camera.name, files[0]}};
  std::vector<Source> sources;
  for (const auto& file : files) sources.push_back({sequence_name(camera.name, sources.size()), file});
  return sources;
}

std::vector<Source> mask_sources(const ShotState& state, const ImageId& image) {
  for (const ShotCamera& camera : state.shot().cameras) {
    if (camera.name != image.camera) continue;
    auto sources = mask_sources(state.shot(), camera);
    if (sources.size() < 2) return sources;
    const auto ingested = state.artifact("ingest/" + camera.name);
    const int index = image.frame + (ingested ? read_footage_trim(*ingested).num_before : 0);
    if (index >= static_cast<int>(sources.size()))
      throw Error(ErrorKind::BadInput,
                  fmt::format("{}:{}: camera '{}' has a mask of {} pictures, but its footage has a picture {}; expected one "
                              "mask, or one per picture of the footage",
                              (state.shot().folder / "shot.toml").string(), camera.line, camera.name, sources.size(),
                              index));
    return {sources[static_cast<std::size_t>(index)]};
  }
  return {};
}

}  // namespace vantage
