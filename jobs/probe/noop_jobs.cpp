#include "jobs/probe/noop_jobs.h"

#include <fmt/format.h>

namespace vantage {
namespace {

std::vector<WorkUnit> empty_units(std::string_view kind, const NoopParams& params) {
  std::vector<WorkUnit> units(static_cast<std::size_t>(params.num_jobs));
  for (std::size_t i = 0; i < units.size(); ++i) {
    units[i].name = fmt::format("{}/{}", kind, i);
    units[i].unit = {{"index", i}};
    units[i].need = {.cores = 1, .ram_mb = 1, .timeout_s = 60};
  }
  return units;
}

}  // namespace

std::vector<WorkUnit> NoopJob::split(const ShotState&, const Params& params) {
  return empty_units(spec().name, params);
}
void NoopJob::run(JobContext&, const Params&) {}

std::vector<WorkUnit> ProcessJob::split(const ShotState&, const Params& params) {
  return empty_units(spec().name, params);
}
void ProcessJob::run(JobContext&, const Params&) {}

}  // namespace vantage
