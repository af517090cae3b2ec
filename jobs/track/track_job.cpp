#include "jobs/track/track_job.h"

#include "jobs/mask_sources.h"

namespace vantage {

std::vector<WorkUnit> TrackJob::split(const ShotState& state, const Params& params) {
  if (state.shot().text("sync", "method", "motion") != "motion") return {};
  std::vector<WorkUnit> units;
  for (const ShotCamera& camera : state.shot().cameras)
    units.push_back({.name = "track/" + camera.name,
                     .params = params_to_json(params),
                     .unit = {{"camera", camera.name}, {"moving", camera.moving}},
                     .needs = {"ingest/" + camera.name, "calibrate"},
                     .sources = mask_sources(state.shot(), camera),
                     .links = {},
                     .need = {.cores = 1, .ram_mb = 900, .timeout_s = 7200}});
  return units;
}

}  // namespace vantage
