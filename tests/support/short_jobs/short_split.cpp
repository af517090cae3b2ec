#include <fmt/format.h>

#include "tests/support/short_jobs/short_jobs.h"

namespace vantage {
namespace {

constexpr Need kSmall{.cores = 1, .ram_mb = 16, .timeout_s = 600};

std::string name_of(const char* kind, int index) { return fmt::format("{}/{:05}", kind, index); }

/// Jobs that need nothing and differ by their number only.
std::vector<WorkUnit> numbered(const char* kind, int num) {
  std::vector<WorkUnit> units;
  for (int i = 0; i < num; ++i) {
    WorkUnit unit;
    unit.name = name_of(kind, i);
    unit.unit = {{"index", i}};
    unit.need = kSmall;
    units.push_back(std::move(unit));
  }
  return units;
}

int num_jobs_of(const ShotState& state, const char* kind, int fallback) {
  const Section section = state.shot().section(kind);
  const auto found = section.values.find("num_jobs");
  return found == section.values.end() ? fallback : found->second.value.get<int>();
}

}  // namespace

const std::vector<KindEntry>& short_kinds() {
  static const std::vector<KindEntry> kinds{kind_entry_of<SeedJob>(), kind_entry_of<MixJob>(),
                                            kind_entry_of<JoinJob>(), kind_entry_of<TroubleJob>(),
                                            kind_entry_of<BlipJob>(), kind_entry_of<ToolJob>()};
  return kinds;
}

std::vector<WorkUnit> SeedJob::split(const ShotState&, const Params& params) {
  std::vector<WorkUnit> units;
  Params that_matter = params;
  that_matter.num_jobs = 1;  // one more job must not change those that are there
  for (int i = 0; i < params.num_jobs; ++i) {
    WorkUnit unit;
    unit.name = name_of("seed", i);
    unit.params = params_to_json(that_matter);
    unit.unit = {{"index", i}};
    unit.links = {{"bytes", fmt::format("seed/{:05}", i)}};
    unit.need = kSmall;
    units.push_back(std::move(unit));
  }
  return units;
}

std::vector<WorkUnit> MixJob::split(const ShotState& state, const Params& params) {
  const int num_seeds = num_jobs_of(state, "seed", SeedJob::Params{}.num_jobs);
  Params that_matter = params;
  that_matter.num_jobs = 0;
  std::vector<WorkUnit> units;
  for (int i = 0; i < params.num_jobs; ++i) {
    WorkUnit unit;
    unit.name = name_of("mix", i);
    unit.params = params_to_json(that_matter);
    unit.unit = {{"index", i}};
    unit.needs = {name_of("seed", i % num_seeds), name_of("seed", (i + 1) % num_seeds)};
    unit.links = {{"bytes", fmt::format("mix/{:05}", i)}};
    unit.need = kSmall;
    units.push_back(std::move(unit));
  }
  return units;
}

std::vector<WorkUnit> JoinJob::split(const ShotState& state, const Params& params) {
  if (params.num_jobs == 0 || !state.artifact(name_of("seed", 0))) return {};
  const int num_mixes = num_jobs_of(state, "mix", 0);
  std::vector<WorkUnit> units;
  for (int i = 0; i < params.num_jobs; ++i) {
    WorkUnit unit;
    unit.name = name_of("join", i);
    unit.unit = {{"index", i}};
    for (int mix = i; mix < num_mixes; mix += params.num_jobs) unit.needs.push_back(name_of("mix", mix));
    unit.links = {{"bytes", fmt::format("join/{:05}", i)}};
    unit.need = kSmall;
    units.push_back(std::move(unit));
  }
  return units;
}

std::vector<WorkUnit> BlipJob::split(const ShotState&, const Params& params) {
  return numbered("blip", params.num_jobs);
}
std::vector<WorkUnit> ToolJob::split(const ShotState&, const Params& params) {
  return numbered("tool", params.num_jobs);
}

std::vector<WorkUnit> TroubleJob::split(const ShotState&, const Params& params) {
  std::vector<WorkUnit> units;
  const auto add = [&](const char* sort, int num, const Json& amount) {
    for (int i = 0; i < num; ++i) {
      WorkUnit unit;
      unit.name = fmt::format("trouble/{}-{}", sort, i);
      unit.unit = {{"sort", sort}, {"index", i}, {"amount", amount}, {"memory_dir", params.memory_dir}};
      unit.need = {.cores = 1, .ram_mb = params.ram_mb, .timeout_s = params.timeout_s};
      units.push_back(std::move(unit));
    }
  };
  add("crash", params.crash, 0);
  add("hang", params.hang, 0);
  add("busy", params.busy, 0);
  add("hog", params.hog, params.hog_mb);
  add("chatter", params.chatter, params.chatter_mb);
  add("flaky", params.flaky, params.num_failures);
  add("slow", params.slow, params.slow_ms);
  add("bad", params.bad, 0);
  return units;
}

}  // namespace vantage
