#pragma once
/// What the shots of one store can still reach: the artifacts that must stay.
#include <filesystem>
#include <set>
#include <string>
#include <unordered_set>
#include <vector>

#include "scheduler/store/sqlite.h"

namespace vantage {

struct Reach {
  std::unordered_set<std::string> artifacts;   ///< "<kind>/<key>"
  std::unordered_set<std::string> spec_names;  ///< "<shot folder>/.vantage/specs/<job>.json" of the plan
  std::unordered_set<std::string> open_logs;   ///< of attempts that are out with workers
  std::set<std::filesystem::path> shots;       ///< folders whose store it is
};

/// State folders of all farms that use the store: those that are noted in it, those of its shots' own runs, and
/// `named` ones. Throws Error(BadInput) when one that is noted cannot be read from here: what it needs is not known.
std::vector<std::filesystem::path> farms_of_store(const std::filesystem::path& store,
                                                  const std::vector<std::filesystem::path>& named);

/// Present plan of every shot that the farms know in this store, keys of attempts that run, targets of links in out/.
Reach reach_of(const std::filesystem::path& store, const std::vector<std::filesystem::path>& state_dirs);

/// Only what attempts that run need: keys, specs, logs.
Reach reach_of_running(Sqlite& db);

/// The real folder of a shot's store; empty when it has none.
std::filesystem::path store_of(const std::filesystem::path& shot_folder);

}  // namespace vantage
