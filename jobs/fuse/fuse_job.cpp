#include "jobs/fuse/fuse_job.h"

namespace vantage {

std::vector<WorkUnit> FuseJob::split(const ShotState&, const Params&) { return {}; }

}  // namespace vantage
