#include "jobs/reconstruct/reconstruct_job.h"
#include "schema/base/error.h"

namespace vantage {

void ReconstructJob::run(JobContext&, const Params&) { throw Error(ErrorKind::Bug, "reconstruct is not written yet"); }

}  // namespace vantage
