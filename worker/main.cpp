#include <opencv2/core.hpp>

#include "jobs/all_jobs.h"
#include "jobs/probe/probe_kinds.h"
#include "jobs/probe/selftest_job.h"
#include "worker/export_command.h"
#include "worker/probe_command.h"
#include "worker/worker_main.h"

int main(int argc, char** argv) {
  return vantage::worker_main(
      argc, argv,
      {.runs = vantage::runs_of(vantage::AllJobs{}, vantage::ProbeJobs{}, vantage::JobList<vantage::SelfTestJob>{}),
       .light_program = "vantage-probe-jobs",
       .light_kinds = vantage::capabilities_of(vantage::runs_of(vantage::ProbeJobs{})).kinds,
       .limit_threads = cv::setNumThreads,
       .probe = vantage::run_probe_command,
       .export_depth = vantage::run_export_command});
}
