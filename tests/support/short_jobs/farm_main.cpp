/// vantage-short-farm: `vantage scheduler` for shots of short jobs.
#include <fmt/format.h>

#include "scheduler/cli/parse.h"
#include "scheduler/cli/serve_farm.h"
#include "schema/base/error.h"
#include "tests/support/short_jobs/short_jobs.h"

int main(int argc, char** argv) {
  using namespace vantage;
  try {
    return serve_farm(parse_serve_options({argv + 1, argv + argc}), short_kinds());
  } catch (const HelpShown&) {
    return 0;
  } catch (const std::exception& e) {
    fmt::print(stderr, "vantage-short-farm: {}\n", e.what());
    return 1;
  }
}
