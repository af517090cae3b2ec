#include "jobs/correspond/correspond_job.h"

namespace vantage {

std::vector<WorkUnit> CorrespondJob::split(const ShotState&, const Params&) { return {}; }

}  // namespace vantage
