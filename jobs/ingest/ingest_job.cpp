#include "jobs/ingest/ingest_job.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <set>

#include "jobs/mask_sources.h"
#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

bool is_pattern(const std::string& name) { return name.find_first_of("*?[") != std::string::npos; }

std::vector<fs::path> entries_like(const fs::path& folder, const std::string& pattern) {
  std::vector<fs::path> out;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none))
    if (fnmatch(pattern.c_str(), entry.path().filename().c_str(), FNM_PERIOD) == 0) out.push_back(entry.path());
  return out;
}

/// The camera's files, or an error that points at its line of shot.toml.
std::vector<fs::path> files_of(const Shot& shot, const ShotCamera& camera) {
  const auto fail = [&](const std::string& what) {
    throw Error(ErrorKind::BadInput,
                fmt::format("{}:{}: camera '{}' names {}, {}", (shot.folder / "shot.toml").string(), camera.line,
                            camera.name, camera.footage, what));
  };
  const auto files = footage_files(shot.folder, camera.footage);
  if (files.empty() && fs::is_directory(shot.folder / camera.footage))
    fail("which is a folder; name its pictures, e.g. \"" + (fs::path(camera.footage) / "*.png").string() + '"');
  if (files.empty()) fail(is_pattern(camera.footage) ? "which matches no file" : "which does not exist");
  const auto num_stills = std::count_if(files.begin(), files.end(), is_still);
  if (files.size() > 1 && static_cast<std::size_t>(num_stills) != files.size())
    fail(fmt::format("which matches {} files that are not all pictures; expected pictures or one video", files.size()));
  return files;
}

WorkUnit unit_of(const Shot& shot, const ShotCamera& camera) {
  const auto files = files_of(shot, camera);
  WorkUnit unit;
  unit.name = "ingest/" + camera.name;
  unit.unit = {{"camera", camera.name}, {"stills", is_still(files[0])}};
  if (camera.fps) unit.unit["fps"] = *camera.fps;
  if (camera.trim_start_s > 0) unit.unit["trim_start_s"] = camera.trim_start_s;
  if (camera.trim_end_s) unit.unit["trim_end_s"] = *camera.trim_end_s;
  for (const auto& file : files) unit.sources.push_back({fmt::format("footage/{:06d}", unit.sources.size()), file});
  unit.need = {.cores = 1, .ram_mb = 1500, .timeout_s = 4 * 3600};
  return unit;
}

}  // namespace

std::vector<fs::path> footage_files(const fs::path& folder, const std::string& footage) {
  if (fs::is_regular_file(folder / footage)) return {folder / footage};
  if (!is_pattern(footage)) return {};
  std::vector<fs::path> found{fs::path(footage).is_absolute() ? fs::path() : folder};
  for (const auto& part : fs::path(footage)) {
    std::vector<fs::path> deeper;
    for (const auto& path : found) {
      if (!is_pattern(part.string()))
        deeper.push_back(path / part);
      else
        for (auto& entry : entries_like(path, part.string())) deeper.push_back(std::move(entry));
    }
    found = std::move(deeper);
  }
  std::erase_if(found, [](const fs::path& path) { return !fs::is_regular_file(path); });
  std::sort(found.begin(), found.end());
  return found;
}

bool is_still(const fs::path& file) {
  static const std::set<std::string> suffixes{".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp", ".exr"};
  std::string suffix = file.extension().string();
  for (char& c : suffix) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return suffixes.contains(suffix);
}

void IngestJob::check(const Shot& shot) {
  for (const auto& camera : shot.cameras) {
    files_of(shot, camera);
    mask_sources(shot, camera);
  }
}

std::vector<WorkUnit> IngestJob::split(const ShotState& state, const Params&) {
  std::vector<WorkUnit> units;
  for (const auto& camera : state.shot().cameras) units.push_back(unit_of(state.shot(), camera));
  return units;
}

}  // namespace vantage
