#include "jobs/align/align_job.h"
#include "schema/base/error.h"

namespace vantage {

void AlignJob::run(JobContext&, const Params&) { throw Error(ErrorKind::Bug, "align is not written yet"); }

}  // namespace vantage
