#include "worker/execute_job.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <new>
#include <system_error>

#include "schema/base/clock.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "worker/commit.h"
#include "worker/machine.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

void check_inputs(const JobFile& job) {
  for (const auto& [name, input] : job.inputs) {
    const auto manifest = read_valid_manifest(input.folder);
    if (!manifest)
      throw Error(ErrorKind::Transient,
                  fmt::format("input {}: no complete artifact in {}", name, input.folder.string()));
    if (manifest->content != input.content)
      throw Error(ErrorKind::Transient, fmt::format("input {}: {} has content {}, expected {}", name,
                                                    input.folder.string(), manifest->content, input.content));
  }
}

/// Footage may be edited while the farm works; a result of the new content under the old key would be believed for
/// ever.
void check_sources(const JobFile& job) {
  for (const auto& [name, source] : job.sources) {
    std::error_code error;
    if (!fs::is_regular_file(source.folder, error))
      throw Error(ErrorKind::BadInput,
                  fmt::format("source {}: {} is not there any more", name, source.folder.string()));
    if (const std::string found = hash_file(source.folder); found != source.content)
      throw Error(ErrorKind::Transient,
                  fmt::format("source {}: {} has changed since the job was planned", name, source.folder.string()));
  }
}

template <class Map>
std::map<std::string, fs::path> paths_of(const Map& inputs) {
  std::map<std::string, fs::path> out;
  for (const auto& [name, input] : inputs) out[name] = input.folder;
  return out;
}

int peak_rss_mb() {
  rusage self{}, children{};
  getrusage(RUSAGE_SELF, &self);
  getrusage(RUSAGE_CHILDREN, &children);
  return static_cast<int>(std::max(self.ru_maxrss, children.ru_maxrss) / 1024);
}

Json provenance_of(const JobFile& job, double wall_s) {
  Json inputs = Json::object(), sources = Json::object();
  for (const auto& [name, input] : job.inputs) inputs[name] = input.content;
  for (const auto& [name, source] : job.sources) sources[name] = source.content;
  return {{"shot", job.shot},   {"params", job.params},         {"unit", job.unit},
          {"inputs", inputs},   {"sources", sources},           {"host", host_name()},
          {"pid", getpid()},    {"build", VANTAGE_VERSION},     {"wall_s", wall_s},
          {"cores", job.cores}, {"peak_rss_mb", peak_rss_mb()}, {"finished_ms", system_clock().wall_ms()}};
}

/// Runs into `folder` and leaves the manifest there.
Manifest run_into(const fs::path& folder, const JobFile& job, const RunFunction& run, const ExecuteOptions& options) {
  JobContext context({.unit = job.unit,
                      .inputs = paths_of(job.inputs),
                      .sources = paths_of(job.sources),
                      .out_dir = folder,
                      .scratch_dir = options.scratch_dir,
                      .cores = job.cores,
                      .on_progress = options.on_progress});
  const auto start = std::chrono::steady_clock::now();
  run(context, job.params);
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  Manifest manifest{.kind = job.kind,
                    .version = job.version,
                    .job = job.job,
                    .key = job.key,
                    .content = {},
                    .files = list_artifact_files(folder)};
  manifest.content = content_hash(manifest.files);
  manifest.figures = context.figures();
  manifest.provenance = provenance_of(job, wall_s);
  write_manifest(folder, manifest);
  return manifest;
}

bool disk_is_full(const fs::path& store) {
  constexpr std::uintmax_t kAlmostNothingMb = 8;
  std::error_code error;
  return fs::exists(store, error) && free_disk_mb(store) < kAlmostNothingMb;
}

}  // namespace

Executed execute_job(const JobFile& job, const RunFunction& run, const ExecuteOptions& options) {
  const fs::path final_folder = artifact_folder(job.store, job.kind, job.key);
  if (auto manifest = read_valid_manifest(final_folder)) return {final_folder, std::move(*manifest), true};
  if (const std::string key = job_key(job); key != job.key)
    throw Error(ErrorKind::BadInput,
                fmt::format("job {}: key is {}, but its contents hash to {}", job.job, job.key, key));
  check_inputs(job);
  check_sources(job);
  remove_private_folders_of(job.store, job.key, 0);
  const PrivateFolder folder(job.store, job.key);
  Manifest manifest = run_into(folder.path(), job, run, options);
  if (commit_artifact(folder.path(), final_folder)) return {final_folder, std::move(manifest), false};
  auto theirs = read_valid_manifest(final_folder);
  check(theirs.has_value(), "who loses the race finds the winner's artifact");
  return {final_folder, std::move(*theirs), true};
}

Error error_of(const std::exception& exception, const fs::path& store) {
  const auto* ours = dynamic_cast<const Error*>(&exception);
  if (ours != nullptr && ours->kind() == ErrorKind::BadInput) return *ours;
  // Many libraries only say that they could not write; the disk knows why.
  if (disk_is_full(store))
    return {ErrorKind::Resource, fmt::format("no disk space left at {}: {}", store.string(), exception.what())};
  if (ours != nullptr) return *ours;
  if (dynamic_cast<const std::bad_alloc*>(&exception) != nullptr) return {ErrorKind::Resource, "out of memory"};
  if (const auto* system = dynamic_cast<const std::system_error*>(&exception)) {
    const bool is_full =
        system->code() == std::errc::no_space_on_device || system->code() == std::errc::not_enough_memory;
    return {is_full ? ErrorKind::Resource : ErrorKind::Transient, system->what()};
  }
  // OpenCV has one exception class for everything.
  const std::string what = exception.what();
  return {what.find("Insufficient memory") != std::string::npos ? ErrorKind::Resource : ErrorKind::Bug, what};
}

}  // namespace vantage
