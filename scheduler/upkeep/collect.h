#pragma once
/// Removes garbage while farms go on: a scheduler may find an old artifact by its key at any moment and use it again.
///
/// So artifacts are first renamed into STORE/.trash: from then on nobody finds them. When the turns that may have seen
/// them before are over, the farms' databases are read again, and what they have come to use is renamed back.
#include <filesystem>
#include <functional>
#include <vector>

#include "scheduler/upkeep/garbage.h"

namespace vantage {

struct Collected {
  std::vector<Garbage> removed;
  std::vector<Garbage> put_back;  ///< a scheduler had just begun to use them
};

struct CollectOptions {
  std::filesystem::path store;
  std::vector<std::filesystem::path> state_dirs;  ///< of all farms that use the store: farms_of_store()
  GarbageAges ages;
  std::function<void()> between;  ///< of tests: runs when all is in the trash and nothing is deleted yet
};

/// Only one at a time works on a store. Throws Error(Transient) while another does, Error(BadInput) as reach_of().
Collected collect_garbage(const CollectOptions& options);

/// Artifacts that a collector which was killed left in the trash go back to their places.
void empty_trash_into_store(const std::filesystem::path& store);

}  // namespace vantage
