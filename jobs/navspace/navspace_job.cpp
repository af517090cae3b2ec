#include "jobs/navspace/navspace_job.h"

namespace vantage {

std::vector<WorkUnit> NavspaceJob::split(const ShotState& state, const Params& params) {
  WorkUnit unit;
  unit.name = "navspace";
  unit.params = params_to_json(params);
  unit.needs = {"calibrate", "align"};
  for (const ShotCamera& camera : state.shot().cameras) unit.needs.push_back("ingest/" + camera.name);
  unit.links = {{"navspace.json", "navspace.json"}};
  unit.need = {.cores = 1, .ram_mb = 500, .timeout_s = 1800};
  return {unit};
}

}  // namespace vantage
