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
  std::filesystem::path scratch_dir;  ///< made when the job asks for it; the caller deletes it
  int input_patience_ms = 30'000;     ///< network storage may show an artifact late
  std::function<void(double fraction, const std::string& phase)> on_progress;
};

/// An input is not what its manifest says: the job that made it must run again.
class DamagedInput : public Error {
 public:
  DamagedInput(std::string job, const std::string& message)
      : Error(ErrorKind::Transient, message), job_(std::move(job)) {}
  const std::string& job() const { return job_; }

 private:
  std::string job_;
};

/// One job of a kind that publishes nothing: it has no inputs, no key and no artifact.
void run_without_artifact(const JobFile& job, const RunFunction& run, const ExecuteOptions& options);

struct Executed {
  std::filesystem::path folder;  ///< the artifact
  Manifest manifest;
  bool was_there = false;  ///< found by its key: nothing was computed
};

/// One job in this process: looks whether its artifact is there, checks its inputs, runs it in a private folder, hashes
/// and commits. A run that throws leaves nothing behind.
/// Throws Error: DamagedInput when an input's files are not what its manifest says; Transient when inputs are missing
/// or are not what the job was planned for, Resource when the disk or the memory is full, and whatever the run throws.
Executed execute_job(const JobFile& job, const RunFunction& run, const ExecuteOptions& options);

/// What any exception means for the attempt: ours as they are, the world's (no memory, no disk) sorted.
Error error_of(const std::exception& exception, const std::filesystem::path& store);

}  // namespace vantage
