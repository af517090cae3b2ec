#include "jobs/align/align_job.h"

namespace vantage {

std::vector<WorkUnit> AlignJob::split(const ShotState&, const Params&) { return {}; }

}  // namespace vantage
