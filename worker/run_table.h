#pragma once
#include <string>
#include <vector>

#include "jobs/kind_entry.h"
#include "worker/execute_job.h"

namespace vantage {

/// A kind of job that this program can do.
struct RunEntry {
  KindSpec spec;
  RunFunction run;
};
using RunTable = std::vector<RunEntry>;

template <class Job>
RunEntry run_entry_of() {
  return {.spec = Job::spec(), .run = [](JobContext& context, const Json& params) {
            Job::run(context, params_from_json<typename Job::Params>(params));
          }};
}

/// One entry per kind of all the lists.
template <class... Lists>
RunTable runs_of(Lists... lists) {
  RunTable table;
  const auto append = [&table]<class... Jobs>(JobList<Jobs...>) { (table.push_back(run_entry_of<Jobs>()), ...); };
  (append(lists), ...);
  return table;
}

/// Throws Error(BadInput) for a kind that is not there (with a suggestion), Error(Transient) when this program has
/// another version of it than the job was planned for: another worker may have the right one.
const RunEntry& find_run(const RunTable& table, const std::string& kind, int version);

/// "depth/1": how a worker says what it can do.
std::string kind_and_version(const KindSpec& spec);

/// What can be done on this machine, and in one sentence per kind what is missing for the rest.
struct Capabilities {
  std::vector<std::string> kinds;    ///< as kind_and_version() says it
  std::vector<std::string> missing;  ///< "calibrate needs the program 'colmap', which is not on PATH"
};
/// Looks for the kinds' programs on PATH.
Capabilities capabilities_of(const RunTable& table);

}  // namespace vantage
