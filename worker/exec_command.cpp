#include "worker/exec_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <optional>

#include "schema/base/error.h"
#include "schema/base/hash.h"
#include "worker/attempt_files.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

/// A folder of its own that goes when it does, unless the caller gave one.
class Scratch {
 public:
  explicit Scratch(const fs::path& given) : path_(given), is_ours_(given.empty()) {
    if (is_ours_)
      path_ = fs::temp_directory_path() / fmt::format("vantage-scratch.{}.{}", getpid(), to_hex(random_bytes(4)));
    fs::create_directories(path_);
  }
  ~Scratch() {
    std::error_code ignored;  // a temporary folder: the system clears what we cannot
    if (is_ours_) fs::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
  bool is_ours_;
};

JobFile read_spec(const ExecOptions& options) {
  if (!fs::exists(options.spec))
    throw Error(options.spec_hash.empty() ? ErrorKind::BadInput : ErrorKind::Transient,
                fmt::format("{}: no such job file", options.spec.string()));
  if (!options.spec_hash.empty() && hash_file(options.spec) != options.spec_hash)
    throw Error(ErrorKind::Transient, fmt::format("{}: is not the job file that was meant", options.spec.string()));
  JobFile job = read_job_file(options.spec);
  if (options.cores > 0) job.cores = options.cores;
  return job;
}

Executed execute(const JobFile& job, const ExecOptions& options, const WorkerProgram& program) {
  const RunFunction& run = find_run(program.runs, job.kind, job.version).run;
  program.limit_threads(job.cores);
  const Scratch scratch(options.scratch_dir);
  ProgressWriter progress(options.progress_file);
  ExecuteOptions execute_options{.scratch_dir = scratch.path(), .on_progress = {}};
  if (!options.progress_file.empty())
    execute_options.on_progress = [&](double fraction, const std::string& phase) { progress.write(fraction, phase); };
  return execute_job(job, run, execute_options);
}

/// Best effort when the disk is full: without an outcome file the worker reports a crash, with less to say.
void leave_outcome(const ExecOptions& options, const DoneAttempt& outcome) {
  if (options.outcome_file.empty()) return;
  try {
    write_outcome(options.outcome_file, outcome);
  } catch (const Error& e) {
    fmt::print(stderr, "error: {}\n", e.what());
  }
}

}  // namespace

int run_exec_command(const ExecOptions& options, const WorkerProgram& program) {
  DoneAttempt outcome;
  fs::path store;
  try {
    const JobFile job = read_spec(options);
    store = job.store;
    fmt::print(stderr, "{} (shot {}, key {})\n", job.job, job.shot, job.key);
    const Executed done = execute(job, options, program);
    outcome.content = done.manifest.content;
    leave_outcome(options, outcome);
    if (done.was_there) fmt::print(stderr, "already there: nothing to compute\n");
    fmt::print("{}\n", done.folder.string());
    return 0;
  } catch (const std::exception& e) {
    const Error error = error_of(e, store);
    outcome.outcome = Outcome::Failed;
    outcome.error_kind = to_string(error.kind());
    outcome.message = one_line(error.what());
    fmt::print(stderr, "error ({}): {}\n", outcome.error_kind, error.what());
    leave_outcome(options, outcome);
    return error.kind() == ErrorKind::BadInput ? 2 : 1;
  }
}

}  // namespace vantage
