#include "jobs/render/render_job.h"
#include "schema/base/error.h"

namespace vantage {

void RenderJob::run(JobContext&, const Params&) { throw Error(ErrorKind::Bug, "render is not written yet"); }

}  // namespace vantage
