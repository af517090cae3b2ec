#include "jobs/all_jobs.h"

namespace vantage {

const std::vector<KindEntry>& all_kinds() {
  static const std::vector<KindEntry> kinds = kind_entries_of(AllJobs{});
  return kinds;
}

const KindEntry* find_kind(const std::string& name) {
  for (const auto& kind : all_kinds())
    if (kind.spec.name == name) return &kind;
  return nullptr;
}

std::vector<std::string> kind_names(const std::vector<KindEntry>& kinds) {
  std::vector<std::string> names;
  for (const auto& kind : kinds) names.emplace_back(kind.spec.name);
  return names;
}

}  // namespace vantage
