#include "jobs/navspace/navspace_job.h"

namespace vantage {

std::vector<WorkUnit> NavspaceJob::split(const ShotState&, const Params&) { return {}; }

}  // namespace vantage
