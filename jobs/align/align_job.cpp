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

}  // namespace

std::vector<WorkUnit> AlignJob::split(const ShotState& state, const Params& params) {
  const Shot& shot = state.shot();
  const bool known = shot.text("sync", "method", "motion") == "known";
  WorkUnit unit{.name = "align",
                .params = known ? Json::object() : params_to_json(params),
                .unit = {{"known", known}, {"cameras", known ? camera_starts(shot) : camera_names(shot)}},
                .needs = {},
                .sources = {},
                .links = {{"clocks.json", "clocks.json"}},
                .need = {.cores = 1, .ram_mb = 200, .timeout_s = 600}};
  for (std::size_t i = 0; i < shot.cameras.size(); ++i) {
    unit.needs.push_back("ingest/" + shot.cameras[i].name);
    for (std::size_t j = i + 1; j < shot.cameras.size() && !known; ++j)
      unit.needs.push_back("sync/" + shot.cameras[i].name + "__" + shot.cameras[j].name);
  }
  return {unit};
}

}  // namespace vantage
