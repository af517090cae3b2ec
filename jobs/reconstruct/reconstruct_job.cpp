#include "jobs/reconstruct/reconstruct_job.h"

#include <set>

#include "jobs/groups/image_groups.h"

namespace vantage {
namespace {

WorkUnit work_unit(const std::vector<ImageId>& images, std::size_t number, const Json& params) {
  WorkUnit unit;
  unit.name = group_job_name(number);
  unit.params = params;
  unit.needs = {"calibrate", "align"};
  std::set<std::string> cameras;
  for (const ImageId& image : images) {
    unit.unit["images"].push_back(image.label());
    if (cameras.insert(image.camera).second) unit.needs.push_back("ingest/" + image.camera);
  }
  unit.need = {.cores = 1, .ram_mb = 1500, .timeout_s = 4 * 3600};
  return unit;
}

}  // namespace

std::vector<WorkUnit> ReconstructJob::split(const ShotState& state, const Params& params) {
  if (!state.shot().has_section("reconstruct")) return {};
  const auto groups = planned_groups(state);
  if (!groups) return {};
  std::vector<WorkUnit> units;
  for (const auto& images : *groups) units.push_back(work_unit(images, units.size(), params_to_json(params)));
  return units;
}

}  // namespace vantage
