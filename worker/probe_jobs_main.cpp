/// vantage-probe-jobs: forks the children of jobs that publish nothing, for vantage-worker.
#include "jobs/probe/probe_kinds.h"
#include "worker/worker_main.h"

int main(int argc, char** argv) {
  return vantage::worker_main(argc, argv, {.runs = vantage::runs_of(vantage::ProbeJobs{})});
}
