#include "jobs/fuse/fuse_job.h"
#include "schema/base/error.h"

namespace vantage {

void FuseJob::run(JobContext&, const Params&) { throw Error(ErrorKind::Bug, "fuse is not written yet"); }

}  // namespace vantage
