#include "worker/exec_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <cstdio>

#include "schema/base/error.h"
#include "schema/base/hash.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

/// A name for a folder that the job may make, gone with everything in it when this is.
class Scratch {
 public:
  Scratch()
      : path_(fs::temp_directory_path() / fmt::format("vantage-scratch.{}.{}", getpid(), to_hex(random_bytes(4)))) {}
  ~Scratch() {
    std::error_code ignored;  // a temporary folder: the system clears what we cannot
    fs::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

JobFile read_spec(const fs::path& spec, const std::string& spec_hash) {
  if (!fs::exists(spec))
    throw Error(spec_hash.empty() ? ErrorKind::BadInput : ErrorKind::Transient,
                fmt::format("{}: no such job file", spec.string()));
  if (!spec_hash.empty() && hash_file(spec) != spec_hash)
    throw Error(ErrorKind::Transient, fmt::format("{}: is not the job file that was meant", spec.string()));
  return read_job_file(spec);
}

struct Work {
  fs::path spec;
  std::string spec_hash, kind, inline_spec;
  ExecuteOptions options;
  int cores = 0;
};

struct Result {
  DoneAttempt outcome;
  fs::path folder;  ///< the artifact, if any
  ErrorKind error = ErrorKind::Bug;
};

JobFile job_of(const Work& work) {
  JobFile job = work.spec.empty() ? inline_job(work.kind, work.inline_spec) : read_spec(work.spec, work.spec_hash);
  if (work.cores > 0) job.cores = work.cores;
  return job;
}

void run_job(const JobFile& job, const Work& work, const WorkerProgram& program, Result& result) {
  const RunEntry& entry = find_run(program.runs, job.kind, job.version);
  program.limit_threads(job.cores);
  if (entry.spec.publishes.empty()) {
    run_without_artifact(job, entry.run, work.options);
    result.outcome.content = kNothingPublished;
    return;
  }
  fmt::print(stderr, "{} (shot {}, key {})\n", job.job, job.shot, job.key);
  const Executed done = execute_job(job, entry.run, work.options);
  if (done.was_there) fmt::print(stderr, "already there: nothing to compute\n");
  result.outcome.content = done.manifest.content;
  result.folder = done.folder;
}

Result run(const Work& work, const WorkerProgram& program) {
  Result result;
  fs::path store;
  try {
    const JobFile job = job_of(work);
    store = job.store;
    run_job(job, work, program, result);
  } catch (const std::exception& e) {
    const Error error = error_of(e, store);
    result.error = error.kind();
    result.outcome.outcome = Outcome::Failed;
    result.outcome.error_kind = to_string(error.kind());
    result.outcome.message = one_line(error.what());
    if (const auto* damaged = dynamic_cast<const DamagedInput*>(&e)) result.outcome.damaged_job = damaged->job();
    fmt::print(stderr, "error ({}): {}\n", result.outcome.error_kind, error.what());
  }
  return result;
}

int exit_status(const Result& result) {
  if (result.outcome.outcome == Outcome::Done) return 0;
  return result.error == ErrorKind::BadInput ? 2 : 1;
}

}  // namespace

JobFile inline_job(const std::string& kind, const std::string& spec) {
  const std::size_t slash = kind.find('/');
  check(slash != std::string::npos, "an assignment names its kind and version");
  JobFile job;
  job.kind = kind.substr(0, slash);
  std::from_chars(kind.data() + slash + 1, kind.data() + kind.size(), job.version);
  if (spec.empty()) return job;
  const Json j = Json::parse(spec);
  job.params = j.value("params", Json::object());
  job.unit = j.value("unit", Json::object());
  return job;
}

int run_exec_command(const ExecOptions& options, const WorkerProgram& program) {
  const Scratch scratch;
  const Result result =
      run({.spec = options.spec,
           .spec_hash = options.spec_hash,
           .kind = {},
           .inline_spec = {},
           .options = {.scratch_dir = options.scratch_dir.empty() ? scratch.path() : options.scratch_dir,
                       .on_progress = {}},
           .cores = options.cores},
          program);
  if (!result.folder.empty()) fmt::print("{}\n", result.folder.string());
  return exit_status(result);
}

int run_child(const ChildRequest& request, ChildLink& link, const WorkerProgram& program) {
  const Result result = run(
      {.spec = request.spec_path,
       .spec_hash = request.spec_hash,
       .kind = request.kind,
       .inline_spec = request.spec,
       .options = {.scratch_dir = request.scratch_dir,
                   .on_progress = [&](double fraction, const std::string& phase) { link.progress(fraction, phase); }},
       .cores = request.cores},
      program);
  link.outcome(result.outcome);
  return exit_status(result);
}

}  // namespace vantage
