#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "jobs/job_context.h"
#include "schema/base/error.h"
#include "schema/formats/job_file.h"
#include "schema/formats/manifest.h"

namespace vantage {

using RunFunction = std::function<void(JobContext&, const Json& params)>;

struct ExecuteOptions {
  std::filesystem::path scratch_dir;  ///< is there; the caller deletes it
  std::function<void(double fraction, const std::string& phase)> on_progress;
};

struct Executed {
  std::filesystem::path folder;  ///< the artifact
  Manifest manifest;
  bool was_there = false;  ///< found by its key: nothing was computed
};

/// One job in this process: looks whether its artifact is there, checks its inputs, runs it in a private folder, hashes
/// and commits. A run that throws leaves nothing behind.
/// Throws Error: Transient when inputs are missing or are not what the job was planned for, Resource when the disk or
/// the memory is full, and whatever the run throws.
Executed execute_job(const JobFile& job, const RunFunction& run, const ExecuteOptions& options);

/// What any exception means for the attempt: ours as they are, the world's (no memory, no disk) sorted.
Error error_of(const std::exception& exception, const std::filesystem::path& store);

}  // namespace vantage
