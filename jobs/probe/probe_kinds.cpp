#include "jobs/probe/probe_kinds.h"

namespace vantage {

const std::vector<KindEntry>& probe_kinds() {
  static const std::vector<KindEntry> kinds = kind_entries_of(ProbeJobs{});
  return kinds;
}

}  // namespace vantage
