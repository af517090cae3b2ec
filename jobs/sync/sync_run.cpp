#include "jobs/sync/sync_job.h"
#include "schema/base/error.h"

namespace vantage {

void SyncJob::run(JobContext&, const Params&) { throw Error(ErrorKind::Bug, "sync is not written yet"); }

}  // namespace vantage
