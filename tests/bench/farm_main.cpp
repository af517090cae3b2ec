/// vantage-bench-farm: `vantage scheduler` for shots of jobs that do nothing.
#include <fmt/format.h>

#include "jobs/probe/probe_kinds.h"
#include "scheduler/cli/parse.h"
#include "scheduler/cli/serve_farm.h"

int main(int argc, char** argv) {
  using namespace vantage;
  try {
    return serve_farm(parse_serve_options({argv + 1, argv + argc}), probe_kinds());
  } catch (const HelpShown&) {
    return 0;
  } catch (const std::exception& e) {
    fmt::print(stderr, "vantage-bench-farm: {}\n", e.what());
    return 1;
  }
}
