#include "jobs/ingest/ingest_job.h"
#include "schema/base/error.h"

namespace vantage {

void IngestJob::run(JobContext&, const Params&) { throw Error(ErrorKind::Bug, "ingest is not written yet"); }

}  // namespace vantage
