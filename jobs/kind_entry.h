#pragma once
#include <functional>
#include <string>
#include <vector>

#include "jobs/job_kind.h"

namespace vantage {

template <class... Jobs>
struct JobList {};

/// What the scheduler and the command line know of a kind.
struct KindEntry {
  KindSpec spec;
  std::function<std::vector<WorkUnit>(const ShotState&)> split;
  std::function<void(const Shot&)> check;  ///< throws Error(BadInput) for bad options of this kind
  std::function<std::vector<ParamDoc>()> params;
};

/// A kind may say more about the shot than its own table's types and ranges: static void check(const Shot&).
template <class Job>
concept ChecksShot = requires(const Shot& shot) {
  Job::check(shot);
};

template <class Job>
KindEntry kind_entry_of() {
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
std::vector<KindEntry> kind_entries_of(JobList<Jobs...>) {
  return {kind_entry_of<Jobs>()...};
}

}  // namespace vantage
