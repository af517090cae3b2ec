#include "jobs/track/track_job.h"

namespace vantage {

std::vector<WorkUnit> TrackJob::split(const ShotState&, const Params&) { return {}; }

}  // namespace vantage
