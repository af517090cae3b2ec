#include "jobs/depth/depth_job.h"

namespace vantage {

std::vector<WorkUnit> DepthJob::split(const ShotState&, const Params&) { return {}; }

}  // namespace vantage
