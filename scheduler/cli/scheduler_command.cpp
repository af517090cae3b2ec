#include "jobs/all_jobs.h"
#include "scheduler/cli/commands.h"
#include "scheduler/cli/serve_farm.h"

namespace vantage {

int scheduler_command(const Arguments& arguments) { return serve_farm(parse_serve_options(arguments), all_kinds()); }

}  // namespace vantage
