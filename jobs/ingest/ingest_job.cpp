#include "jobs/ingest/ingest_job.h"

namespace vantage {

std::vector<WorkUnit> IngestJob::split(const ShotState&, const Params&) { return {}; }

}  // namespace vantage
