#include "jobs/encode/encode_job.h"
#include "schema/base/error.h"

namespace vantage {

void EncodeJob::run(JobContext&, const Params&) { throw Error(ErrorKind::Bug, "encode is not written yet"); }

}  // namespace vantage
