#include "worker/run_table.h"

#include <fmt/format.h>

#include "jobs/all_jobs.h"
#include "jobs/probe/probe_kinds.h"
#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

template <class Job>
RunEntry entry_of() {
  return {.spec = Job::spec(), .run = [](JobContext& context, const Json& params) {
            Job::run(context, params_from_json<typename Job::Params>(params));
          }};
}

template <class... Jobs, class... Probes>
std::vector<RunEntry> entries_of(JobList<Jobs...>, JobList<Probes...>) {
  return {entry_of<Jobs>()..., entry_of<Probes>()...};
}

}  // namespace

const std::vector<RunEntry>& run_table() {
  static const std::vector<RunEntry> table = entries_of(AllJobs{}, ProbeJobs{});
  return table;
}

const RunFunction& find_run(const std::string& kind, int version) {
  for (const RunEntry& entry : run_table()) {
    if (entry.spec.name != kind) continue;
    if (entry.spec.version != version)
      throw Error(ErrorKind::Transient, fmt::format("job wants version {} of {}, this worker has version {}", version,
                                                    kind, entry.spec.version));
    return entry.run;
  }
  throw Error(ErrorKind::BadInput, fmt::format("no job kind '{}'{}", kind, did_you_mean(kind, kind_names())));
}

}  // namespace vantage
