#include "jobs/encode/encode_job.h"

namespace vantage {

std::vector<WorkUnit> EncodeJob::split(const ShotState&, const Params&) { return {}; }

}  // namespace vantage
