#pragma once
/// What may go from a store and from the private folders of its shots.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "scheduler/upkeep/reach.h"

namespace vantage {

struct Garbage {
  enum class What { Artifact, Unfinished, Spec, Log };
  What what = What::Artifact;
  std::filesystem::path path;
  std::uintmax_t num_bytes = 0;
  std::string why;
};
std::string_view to_string(Garbage::What what);

struct GarbageAges {
  std::int64_t now_ms = 0;           ///< wall clock
  std::int64_t keep_ms = 0;          ///< artifacts and specs that are younger stay
  std::int64_t keep_logs_ms = 0;     ///< logs of ended attempts that are younger stay,
  std::uintmax_t max_log_bytes = 0;  ///< unless a shot's logs are more than this: then the oldest go first
};

/// Looks only.
std::vector<Garbage> find_garbage(const std::filesystem::path& store, const Reach& reach, const GarbageAges& ages);
/// The logs alone, of one shot.
std::vector<Garbage> find_old_logs(const std::filesystem::path& shot_folder, const Reach& reach,
                                   const GarbageAges& ages);

}  // namespace vantage
