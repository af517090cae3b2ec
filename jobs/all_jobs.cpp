#include "jobs/all_jobs.h"

namespace vantage {
namespace {

/// A kind may say more about the shot than its own table's types and ranges: static void check(const Shot&).
template <class Job>
concept ChecksShot = requires(const Shot& shot) {
  Job::check(shot);
};

template <class Job>
KindEntry entry_of() {
  using Params = typename Job::Params;
  const std::string kind(Job::spec().name);
  const auto params_of = [kind](const Shot& shot) { return params_from_section<Params>(shot.section(kind)); };
  return {.spec = Job::spec(),
          .split = [params_of](const ShotState& state) { return Job::split(state, params_of(state.shot())); },
          .check =
              [params_of](const Shot& shot) {
                params_of(shot);
                if constexpr (ChecksShot<Job>) Job::check(shot);
              },
          .params = [] { return describe_params<Params>(); }};
}

template <class... Jobs>
std::vector<KindEntry> entries_of(JobList<Jobs...>) {
  return {entry_of<Jobs>()...};
}

}  // namespace

const std::vector<KindEntry>& all_kinds() {
  static const std::vector<KindEntry> kinds = entries_of(AllJobs{});
  return kinds;
}

const KindEntry* find_kind(const std::string& name) {
  for (const auto& kind : all_kinds())
    if (kind.spec.name == name) return &kind;
  return nullptr;
}

std::vector<std::string> kind_names() {
  std::vector<std::string> names;
  for (const auto& kind : all_kinds()) names.emplace_back(kind.spec.name);
  return names;
}

}  // namespace vantage
