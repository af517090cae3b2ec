#include "jobs/track/track_job.h"
#include "schema/base/error.h"

namespace vantage {

void TrackJob::run(JobContext&, const Params&) { throw Error(ErrorKind::Bug, "track is not written yet"); }

}  // namespace vantage
