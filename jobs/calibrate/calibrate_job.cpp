#include "jobs/calibrate/calibrate_job.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <sstream>

#include "jobs/mask_sources.h"
#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr const char* kModelFiles[] = {"cameras.txt", "images.txt", "points3D.txt"};

/// Names that run() asks for.
constexpr const char* kTomlSource = "cameras.toml";
constexpr const char* kChanFolder = "chan/";

/// Files of the known model: a COLMAP text model, whose points may be missing (none are known then), a TOML file, or
/// without a model every camera's own .chan file.
std::vector<Source> model_sources(const Shot& shot, const std::string& model) {
  std::vector<Source> sources;
  if (model.empty())
    for (const ShotCamera& camera : shot.cameras)
      sources.push_back({kChanFolder + camera.name, shot.folder / camera.calibration});
  else if (fs::path(model).extension() == ".toml")
    sources.push_back({kTomlSource, shot.folder / model});
  if (!sources.empty()) return sources;
  for (const char* name : {"cameras.txt", "images.txt", "points3D.txt", "cameras_distorted.txt"})
    if (const fs::path file = shot.folder / model / name; fs::exists(file)) sources.push_back({name, file});
  return sources;
}

/// What of the params a method reads: only that may be in the job's key.
Json params_that_matter(const CalibrateJob::Params& params) {
  if (params.method == "known") return {{"method", "known"}, {"match_colour", params.match_colour}};
  Json out = params_to_json(params);
  out.erase("model");
  return out;
}

}  // namespace

namespace {

void check_chan_files(const Shot& shot, const Section& section) {
  for (const ShotCamera& camera : shot.cameras)
    if (camera.calibration.empty() || fs::path(camera.calibration).extension() != ".chan" ||
        !fs::is_regular_file(shot.folder / camera.calibration))
      throw Error(ErrorKind::BadInput,
                  fmt::format("{}: is \"known\", so [calibrate] model = \"folder or file.toml\" is needed, or "
                              "calibration = \"file.chan\" of every camera; that of camera '{}' (line {}) is '{}'",
                              section.where("method"), camera.name, camera.line, camera.calibration));
}

void check_known_distance(const Shot& shot, const Section& section, const CalibrateJob::Params& params) {
  const bool has_names = !params.known_distance.empty();
  if (has_names != (params.known_distance_m > 0))
    throw Error(ErrorKind::BadInput, section.where(has_names ? "known_distance" : "known_distance_m") +
                                         ": known_distance and known_distance_m are needed together");
  if (!has_names) return;
  std::istringstream words(params.known_distance);
  std::vector<std::string> names{std::istream_iterator<std::string>(words), {}};
  const auto is_static = [&](const std::string& name) {
    return std::any_of(shot.cameras.begin(), shot.cameras.end(),
                       [&](const ShotCamera& c) { return c.name == name && !c.moving; });
  };
  if (names.size() != 2 || names[0] == names[1] || !is_static(names[0]) ||
      !(names[1] == "ground" || is_static(names[1])))
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: is \"{}\", expected two of the cameras that do not move, or one and the word ground",
                            section.where("known_distance"), params.known_distance));
}

}  // namespace

void CalibrateJob::check(const Shot& shot) {
  const Section section = shot.section("calibrate");
  const Params params = params_from_section<Params>(section);
  if (params.method != "known") return check_known_distance(shot, section, params);
  if (params.model.empty()) return check_chan_files(shot, section);
  const fs::path model = shot.folder / params.model;
  if (model.extension() == ".toml") {
    if (!fs::is_regular_file(model))
      throw Error(ErrorKind::BadInput, fmt::format("{}: {} does not exist", section.where("model"), params.model));
    return;
  }
  for (const char* name : kModelFiles)
    if (std::string(name) != "points3D.txt" && !fs::is_regular_file(model / name))
      throw Error(ErrorKind::BadInput, fmt::format("{}: {} has no {}; expected a COLMAP text model or a .toml file",
                                                   section.where("model"), params.model, name));
}

std::vector<WorkUnit> CalibrateJob::split(const ShotState& state, const Params& params) {
  const Shot& shot = state.shot();
  check(shot);
  WorkUnit unit;
  unit.name = "calibrate";
  unit.params = params_that_matter(params);
  // Known clocks let what moves be matched; they matter to nothing else here.
  const bool clocks_are_known = params.method != "known" && shot.text("sync", "method", "") == "known";
  for (const auto& camera : shot.cameras) {
    Json entry{{"name", camera.name}, {"moving", camera.moving}};
    if (clocks_are_known && camera.start_s) entry["start_s"] = *camera.start_s;
    unit.unit["cameras"].push_back(entry);
    unit.needs.push_back("ingest/" + camera.name);
    std::ranges::move(mask_sources(shot, camera), std::back_inserter(unit.sources));
  }
  if (params.method == "known") std::ranges::move(model_sources(shot, params.model), std::back_inserter(unit.sources));
  unit.links = {{"", "calibration/"}};
  unit.need = {.cores = params.method == "known" ? 1 : 2, .ram_mb = 2500, .timeout_s = 6 * 3600};
  return {unit};
}

}  // namespace vantage
