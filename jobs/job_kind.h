#pragma once
/// What every job kind says of itself, light enough for the scheduler. See ARCHITECTURE.md, "to add a job kind".
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "schema/base/json.h"
#include "schema/shot/params.h"
#include "schema/shot/shot.h"

namespace vantage {

/// name: folder, shot.toml table and store folder. version goes up when outputs change. programs: what must be on PATH,
/// with blanks between; a worker that lacks one does not offer the kind.
struct KindSpec {
  std::string_view name;
  int version;
  std::string_view reads;
  std::string_view publishes;  ///< empty: no artifact at all, a report of its end is all there is
  bool in_worker = false;      ///< runs inside the worker's own process: only what is done at once and cannot fail
  std::string_view programs = {};
};

/// Content hash of a job whose kind leaves no artifact behind.
inline constexpr std::string_view kNothingPublished = "nothing";

/// What an attempt may use.
struct Need {
  int cores = 1;
  int ram_mb = 1000;
  int timeout_s = 3600;
};

/// A file of the artifact, or with a trailing '/' a folder of it, and where people find it below SHOT/out.
struct OutLink {
  std::string from;
  std::string to;
};

/// A file from outside the farm that a job reads; its content is part of the job's key.
struct Source {
  std::string name;            ///< what run() asks for: JobContext::source(name)
  std::filesystem::path path;  ///< absolute
};

/// One job to be: everything that its key is made of, but the contents of its inputs.
struct WorkUnit {
  std::string name;                ///< unique in the shot, "<kind>/<what>", e.g. "correspond/cam0-000003__cam1-000004"
  Json params = Json::object();    ///< the kind's Params, only those that matter
  Json unit = Json::object();      ///< which camera, frame, edge…: what tells this job from its siblings
  std::vector<std::string> needs;  ///< names of jobs whose artifacts it reads
  std::vector<Source> sources;
  std::vector<OutLink> links;
  Need need;
};

/// What a split may look at: the shot file and the artifacts of finished jobs.
class ShotState {
 public:
  /// artifact_of: folder of a finished job's artifact, by job name; nothing while it is not done.
  using ArtifactLookup = std::function<std::optional<std::filesystem::path>(const std::string& job_name)>;
  ShotState(const Shot& shot, ArtifactLookup artifact_of) : shot_(shot), artifact_of_(std::move(artifact_of)) {}

  const Shot& shot() const { return shot_; }
  std::optional<std::filesystem::path> artifact(const std::string& job_name) const { return artifact_of_(job_name); }

 private:
  const Shot& shot_;
  ArtifactLookup artifact_of_;
};

}  // namespace vantage
