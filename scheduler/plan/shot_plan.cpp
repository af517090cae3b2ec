#include "scheduler/plan/shot_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <unordered_map>

#include "schema/base/error.h"
#include "schema/base/hash.h"

namespace vantage {
namespace {

/// What one kind's split said, and which artifacts it asked for.
struct Split {
  std::vector<WorkUnit> units;
  std::set<std::string> asked, missing;
  std::string error;
};

Split split_kind(const Shot& shot, const KindEntry& kind, const ShotState::ArtifactLookup& artifact_of) {
  Split split;
  const ShotState state(shot, [&](const std::string& job) {
    auto folder = artifact_of(job);
    split.asked.insert(job);
    if (!folder) split.missing.insert(job);
    return folder;
  });
  try {
    split.units = kind.split(state);
  } catch (const std::exception& e) {
    split.error = e.what();
  }
  return split;
}

std::string kind_of_job(const std::string& job) { return job.substr(0, job.find('/')); }

/// until_kind and, over and over, the kinds of what it needs or asked for.
std::set<std::string> wanted_kinds(const std::map<std::string, Split>& splits, const std::string& until_kind) {
  std::set<std::string> wanted;
  std::vector<std::string> open{until_kind};
  while (!open.empty()) {
    const std::string kind = open.back();
    open.pop_back();
    const auto split = splits.find(kind);
    if (split == splits.end() || !wanted.insert(kind).second) continue;
    for (const auto& job : split->second.asked) open.push_back(kind_of_job(job));
    for (const auto& unit : split->second.units)
      for (const auto& need : unit.needs) open.push_back(kind_of_job(need));
  }
  return wanted;
}

using IndexByName = std::unordered_map<std::string, std::size_t>;

IndexByName index_by_name(const std::vector<PlannedUnit>& units) {
  IndexByName index;
  for (std::size_t i = 0; i < units.size(); ++i)
    if (!index.emplace(units[i].unit.name, i).second)
      throw Error(ErrorKind::Bug, fmt::format("{}: is planned twice", units[i].unit.name));
  return index;
}

/// Kahn's algorithm; jobs that are ready at the same time keep their order.
std::vector<PlannedUnit> needs_first(std::vector<PlannedUnit> units) {
  const IndexByName index = index_by_name(units);
  std::vector<std::vector<std::size_t>> dependents(units.size());
  std::vector<std::size_t> num_open(units.size()), order;
  for (std::size_t i = 0; i < units.size(); ++i) {
    for (const auto& need : units[i].unit.needs) {
      const auto found = index.find(need);
      if (found == index.end())
        throw Error(ErrorKind::Bug, fmt::format("{}: needs {}, which nobody plans", units[i].unit.name, need));
      dependents[found->second].push_back(i);
    }
    num_open[i] = units[i].unit.needs.size();
    if (num_open[i] == 0) order.push_back(i);
  }
  for (std::size_t next = 0; next < order.size(); ++next)
    for (const std::size_t dependent : dependents[order[next]])
      if (--num_open[dependent] == 0) order.push_back(dependent);
  if (order.size() != units.size()) {
    const auto stuck = std::find_if(num_open.begin(), num_open.end(), [](std::size_t n) { return n > 0; });
    throw Error(ErrorKind::Bug, fmt::format("{}: needs itself, by way of others",
                                            units[static_cast<std::size_t>(stuck - num_open.begin())].unit.name));
  }
  std::vector<PlannedUnit> sorted;
  sorted.reserve(units.size());
  for (const std::size_t i : order) sorted.push_back(std::move(units[i]));
  return sorted;
}

}  // namespace

ShotPlan plan_shot(const Shot& shot, const std::vector<KindEntry>& kinds, const std::string& until_kind,
                   const ShotState::ArtifactLookup& artifact_of) {
  std::map<std::string, Split> splits;
  for (const auto& kind : kinds) splits.emplace(kind.spec.name, split_kind(shot, kind, artifact_of));
  const std::set<std::string> wanted = until_kind.empty() ? std::set<std::string>{} : wanted_kinds(splits, until_kind);

  ShotPlan plan;
  for (std::size_t stage = 0; stage < kinds.size(); ++stage) {
    const std::string name(kinds[stage].spec.name);
    if (!until_kind.empty() && !wanted.contains(name)) continue;
    Split& split = splits.at(name);
    plan.asked.merge(split.asked);
    plan.missing.merge(split.missing);
    if (!split.error.empty()) plan.errors.emplace(name, split.error);
    for (auto& unit : split.units)
      plan.units.push_back(
          {std::move(unit), name, static_cast<int>(stage), kinds[stage].spec.version, placement_of(shot, name)});
  }
  plan.units = needs_first(std::move(plan.units));
  return plan;
}

std::string plan_hash(const PlannedUnit& p) {
  Json sources = Json::array(), links = Json::array();
  for (const auto& source : p.unit.sources) sources.push_back({source.name, source.path.string()});
  for (const auto& link : p.unit.links) links.push_back({link.from, link.to});
  Json all = {p.kind,  p.stage, p.version,         p.unit.params,      p.unit.unit,          p.unit.needs,
              sources, links,   p.unit.need.cores, p.unit.need.ram_mb, p.unit.need.timeout_s};
  if (!p.placement.pool.empty() || !p.placement.tags.empty()) {
    all.push_back(p.placement.pool);
    all.push_back(p.placement.tags);
  }
  return hash_bytes(all.dump());
}

}  // namespace vantage
