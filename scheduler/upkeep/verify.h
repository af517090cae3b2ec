#pragma once
/// Are a shot's results still what was computed, and would they be computed so again?
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "scheduler/store/sqlite.h"

namespace vantage {

/// One artifact of the shot's present plan.
struct PlannedArtifact {
  std::int64_t job_id = 0;
  std::string job, kind, key, content;
};
/// Of jobs that are done or were up to date, and publish something. Throws Error(BadInput) when the farm does not know
/// the shot.
std::vector<PlannedArtifact> finished_artifacts(Sqlite& db, const std::filesystem::path& shot_folder);

/// Reads every file. Empty when all is well; else what is wrong, naming the file.
std::string why_damaged(const std::filesystem::path& artifact_folder, const std::string& content);

/// Out of the way, to STORE/.tmp, where `vantage gc` finds it: the job's next run makes it again.
void move_damaged_aside(const std::filesystem::path& store, const PlannedArtifact& artifact);

struct Recomputed {
  enum class Verdict { Same, Differs, Failed };
  Verdict verdict = Verdict::Failed;
  std::string text;  ///< content that came out, or why none did
  double wall_s = 0;
};
/// Runs the job once more, with the inputs that the shot has, into a store of its own, which is removed afterwards.
Recomputed recompute(Sqlite& db, const PlannedArtifact& artifact, const std::filesystem::path& shot_folder,
                     const std::filesystem::path& worker_program);

}  // namespace vantage
