#include "jobs/sync/sync_job.h"

namespace vantage {

std::vector<WorkUnit> SyncJob::split(const ShotState&, const Params&) { return {}; }

}  // namespace vantage
