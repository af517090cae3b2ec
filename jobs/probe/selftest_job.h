#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "jobs/job_context.h"
#include "jobs/job_kind.h"

namespace vantage {

/// Checks whether a machine can do what it offers: the disk that jobs' results are on, the libraries, the programs.
/// No shot has such jobs: the scheduler makes one for a worker that it doubts.
struct SelfTestJob {
  struct Params {
    void fields(auto&&) {}
  };
  static KindSpec spec() { return {.name = "selftest", .version = 1, .reads = "nothing", .publishes = ""}; }
  static std::vector<WorkUnit> split(const ShotState&, const Params&) { return {}; }
  /// Throws Error(Transient): one line that names every check that failed, and how.
  static void run(JobContext& context, const Params& params);
};

/// store: SHOT/.vantage/store of the results at stake. kinds: as the worker reports them ("ingest/2"); what none of
/// them needs is not checked. number: tells one test of a worker from the next.
WorkUnit selftest_unit(const std::string& worker_id, const std::filesystem::path& store,
                       const std::vector<std::string>& kinds, std::int64_t number);

}  // namespace vantage
