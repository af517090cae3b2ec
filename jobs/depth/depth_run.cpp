#include "jobs/depth/depth_job.h"
#include "schema/base/error.h"

namespace vantage {

void DepthJob::run(JobContext&, const Params&) { throw Error(ErrorKind::Bug, "depth is not written yet"); }

}  // namespace vantage
