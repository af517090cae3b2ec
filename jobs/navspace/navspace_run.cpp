#include "jobs/navspace/navspace_job.h"
#include "schema/base/error.h"

namespace vantage {

void NavspaceJob::run(JobContext&, const Params&) { throw Error(ErrorKind::Bug, "navspace is not written yet"); }

}  // namespace vantage
