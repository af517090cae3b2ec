/// vantage-short-worker: a worker that can do short jobs.
#include "worker/worker_main.h"

#include "tests/support/short_jobs/short_jobs.h"

int main(int argc, char** argv) {
  using namespace vantage;
  return worker_main(argc, argv,
                     {.runs = {run_entry_of<SeedJob>(), run_entry_of<MixJob>(), run_entry_of<JoinJob>(),
                               run_entry_of<TroubleJob>(), run_entry_of<BlipJob>(), run_entry_of<ToolJob>()}});
}
