#pragma once
/// The plan of a shot as a pure function of its file and of the artifacts that are there.
#include <map>
#include <set>
#include <string>
#include <vector>

#include "jobs/all_jobs.h"
#include "schema/shot/placement.h"

namespace vantage {

struct PlannedUnit {
  WorkUnit unit;
  std::string kind;
  int stage = 0;  ///< place of the kind in the list of kinds
  int version = 0;
  Placement placement{};
};

struct ShotPlan {
  std::vector<PlannedUnit> units;             ///< what a job needs stands before it
  std::set<std::string> asked;                ///< jobs whose artifacts a split looked at
  std::set<std::string> missing;              ///< of those, the ones that were not there: plan again when one is
  std::map<std::string, std::string> errors;  ///< by kind whose split failed: nothing is known of its jobs
};

/// until_kind: plan this kind and the kinds it needs, as far as its jobs and what its split asked for tell; empty: all.
/// Throws Error(Bug) when a job needs one that nobody plans, or itself by way of others, or when two have one name.
ShotPlan plan_shot(const Shot& shot, const std::vector<KindEntry>& kinds, const std::string& until_kind,
                   const ShotState::ArtifactLookup& artifact_of);

/// Hash of all that the plan says of a job: equal for an unchanged one.
std::string plan_hash(const PlannedUnit& planned);

}  // namespace vantage
