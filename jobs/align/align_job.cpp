#include "jobs/align/align_job.h"

#include <fmt/format.h>

#include "schema/base/error.h"

namespace vantage {
namespace {

Json camera_starts(const Shot& shot) {
  Json cameras = Json::array();
  for (const ShotCamera& camera : shot.cameras) {
    if (!camera.start_s)
      throw Error(
          ErrorKind::BadInput,
          fmt::format("shot.toml:{}: camera '{}' has no start_s, which [sync] method = \"known\" needs: the shot time "
                      "of its first frame in seconds",
                      camera.line, camera.name));
    cameras.push_back({{"name", camera.name}, {"start_s", *camera.start_s}});
  }
  return cameras;
}

Json camera_names(const Shot& shot) {
  Json cameras = Json::array();
  for (const ShotCamera& camera : shot.cameras) cameras.push_back({{"name", camera.name}});
  cameras[0]["start_s"] = shot.cameras.front().start_s.value_or(0);
  return cameras;
}

/// By name, of cameras that stand still.
Json static_readout_ms(const Shot& shot) {
  Json readouts = Json::object();
  for (const ShotCamera& camera : shot.cameras)
    if (!camera.moving) readouts[camera.name] = camera.readout_ms;
  return readouts;
}

}  // namespace

std::vector<WorkUnit> AlignJob::split(const ShotState& state, const Params& params) {
  const Shot& shot = state.shot();
  const std::string method = shot.text("sync", "method", "motion");
  const bool known = method == "known", joint = params.joint && method == "motion";
  WorkUnit unit{.name = "align",
                .params = known ? Json::object() : params_to_json(params),
                .unit = {{"known", known}, {"cameras", known ? camera_starts(shot) : camera_names(shot)}},
                .needs = {},
                .sources = {},
                .links = {{"clocks.json", "clocks.json"}},
                .need = {.cores = 1, .ram_mb = joint ? 1200 : 200, .timeout_s = joint ? 3600 : 600}};
  if (joint) {
    unit.unit["joint"] = {{"known_cameras", shot.text("calibrate", "method", "colmap") == "known"},
                          {"static_readout_ms", static_readout_ms(shot)}};
    unit.needs.push_back("calibrate");
  }
  for (std::size_t i = 0; i < shot.cameras.size(); ++i) {
    unit.needs.push_back("ingest/" + shot.cameras[i].name);
    if (joint) unit.needs.push_back("track/" + shot.cameras[i].name);
    for (std::size_t j = i + 1; j < shot.cameras.size() && !known; ++j)
      unit.needs.push_back("sync/" + shot.cameras[i].name + "__" + shot.cameras[j].name);
  }
  return {unit};
}

}  // namespace vantage
