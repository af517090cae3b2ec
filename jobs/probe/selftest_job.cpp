#include "jobs/probe/selftest_job.h"

namespace vantage {

WorkUnit selftest_unit(const std::string& worker_id, const std::filesystem::path& store,
                       const std::vector<std::string>& kinds, std::int64_t number) {
  WorkUnit unit;
  unit.name = "selftest/" + worker_id;
  unit.unit = {{"worker", worker_id}, {"store", store.string()}, {"kinds", kinds}, {"number", number}};
  unit.need = {.cores = 1, .ram_mb = 500, .timeout_s = 120};
  return unit;
}

}  // namespace vantage
