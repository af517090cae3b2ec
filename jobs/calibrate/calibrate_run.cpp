#include "jobs/calibrate/calibrate_job.h"
#include "schema/base/error.h"

namespace vantage {

void CalibrateJob::run(JobContext&, const Params&) { throw Error(ErrorKind::Bug, "calibrate is not written yet"); }

}  // namespace vantage
