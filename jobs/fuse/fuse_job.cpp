#include "jobs/fuse/fuse_job.h"

#include "jobs/groups/image_groups.h"

namespace vantage {

std::vector<WorkUnit> FuseJob::split(const ShotState& state, const Params& params) {
  if (!state.shot().has_section("reconstruct")) return {};
  const auto groups = planned_groups(state);
  if (!groups || groups->empty()) return {};
  WorkUnit unit;
  unit.name = "fuse";
  unit.params = params_to_json(params);
  unit.unit["groups"] = groups->size();
  unit.needs = {"calibrate"};
  for (std::size_t g = 0; g < groups->size(); ++g) unit.needs.push_back(group_job_name(g));
  unit.links = {{"patches.ply", "model/patches.ply"}, {"surface.ply", "model/surface.ply"}, {"points/", "model/"}};
  unit.need = {.cores = 1, .ram_mb = 3000, .timeout_s = 2 * 3600};
  return {unit};
}

}  // namespace vantage
