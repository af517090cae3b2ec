#include "jobs/render/render_job.h"

namespace vantage {

std::vector<WorkUnit> RenderJob::split(const ShotState&, const Params&) { return {}; }

}  // namespace vantage
