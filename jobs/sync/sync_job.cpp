#include "jobs/sync/sync_job.h"

#include "schema/base/error.h"

namespace vantage {
namespace {

/// Only what the method looks at: another value of anything else must not make a new job.
Json params_that_matter(const SyncJob::Params& params) {
  if (params.method == "motion") return params_to_json(params);
  return {{"method", params.method}, {"max_offset_s", params.max_offset_s}};
}

WorkUnit pair_unit(const ShotCamera& a, const ShotCamera& b, const SyncJob::Params& params) {
  WorkUnit unit{.name = "sync/" + a.name + "__" + b.name,
                .params = params_that_matter(params),
                .unit = {{"a", a.name}, {"b", b.name}},
                .needs = {"ingest/" + a.name, "ingest/" + b.name},
                .sources = {},
                .links = {},
                .need = {.cores = 1, .ram_mb = 1200, .timeout_s = 3600}};
  if (params.method == "motion") {
    unit.unit["moving_a"] = a.moving;
    unit.unit["moving_b"] = b.moving;
    unit.unit["readout_ms_a"] = a.readout_ms;
    unit.unit["readout_ms_b"] = b.readout_ms;
    unit.needs.insert(unit.needs.end(), {"track/" + a.name, "track/" + b.name, "calibrate"});
  }
  return unit;
}

}  // namespace

std::vector<WorkUnit> SyncJob::split(const ShotState& state, const Params& params) {
  if (params.method == "known") return {};
  const auto& cameras = state.shot().cameras;
  std::vector<WorkUnit> units;
  for (std::size_t i = 0; i < cameras.size(); ++i)
    for (std::size_t j = i + 1; j < cameras.size(); ++j) units.push_back(pair_unit(cameras[i], cameras[j], params));
  return units;
}

}  // namespace vantage
