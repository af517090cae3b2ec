#include "jobs/reconstruct/reconstruct_job.h"

namespace vantage {

std::vector<WorkUnit> ReconstructJob::split(const ShotState&, const Params&) { return {}; }

}  // namespace vantage
