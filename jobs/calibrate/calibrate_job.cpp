#include "jobs/calibrate/calibrate_job.h"

namespace vantage {

std::vector<WorkUnit> CalibrateJob::split(const ShotState&, const Params&) { return {}; }

}  // namespace vantage
