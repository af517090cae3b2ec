#include "jobs/correspond/correspond_job.h"
#include "schema/base/error.h"

namespace vantage {

void CorrespondJob::run(JobContext&, const Params&) { throw Error(ErrorKind::Bug, "correspond is not written yet"); }

}  // namespace vantage
