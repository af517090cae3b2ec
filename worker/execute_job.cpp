#include "worker/execute_job.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <new>
#include <system_error>
#include <thread>

#include "schema/base/clock.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "worker/commit.h"
#include "worker/machine.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

/// Opens the exact path again and again: what a listing of the folder says may be older still.
std::optional<Manifest> wait_for_manifest(const fs::path& folder, std::int64_t patience_ms) {
  const std::int64_t give_up_ms = system_clock().monotonic_ms() + patience_ms;
  for (std::int64_t pause_ms = 100;; pause_ms = std::min<std::int64_t>(2 * pause_ms, 5'000)) {
    if (auto manifest = read_valid_manifest(folder)) return manifest;
    const std::int64_t left_ms = give_up_ms - system_clock().monotonic_ms();
    if (left_ms <= 0) return std::nullopt;
    std::this_thread::sleep_for(std::chrono::milliseconds(std::min(pause_ms, left_ms)));
  }
}

/// A damaged artifact must never be computed upon. Files up to a size are read whole, which costs little beside the job
/// that reads them anyway; of larger ones the size was checked, and `vantage verify` reads them.
void check_files(const std::string& name, const JobFile::Input& input, const Manifest& manifest) {
  constexpr std::uintmax_t kReadWholeBytes = 8 << 20U;
  constexpr std::uintmax_t kReadAtMostBytes = 64 << 20U;
  std::uintmax_t num_read = 0;
  for (const auto& file : manifest.files) {
    if (file.size > kReadWholeBytes || num_read + file.size > kReadAtMostBytes) continue;
    num_read += file.size;
    const fs::path path = input.folder / file.path;
    if (const std::string found = hash_file(path); found != file.xxh3)
      throw DamagedInput(name, fmt::format("input {}: {} is damaged: its hash is {}, its manifest says {}", name,
                                           path.string(), found, file.xxh3));
  }
}

void check_inputs(const JobFile& job, std::int64_t patience_ms) {
  for (const auto& [name, input] : job.inputs) {
    const auto manifest = wait_for_manifest(input.folder, patience_ms);
    if (!manifest && fs::exists(input.folder / "manifest.json"))
      throw DamagedInput(name, fmt::format("input {}: {} is damaged: its files are not those of its manifest", name,
                                           input.folder.string()));
    if (!manifest)
      throw Error(ErrorKind::Transient,
                  fmt::format("input {}: no complete artifact in {}", name, input.folder.string()));
    if (manifest->content != input.content)
      throw Error(ErrorKind::Transient, fmt::format("input {}: {} has content {}, expected {}", name,
                                                    input.folder.string(), manifest->content, input.content));
    check_files(name, input, *manifest);
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

void run_without_artifact(const JobFile& job, const RunFunction& run, const ExecuteOptions& options) {
  JobContext context({.unit = job.unit,
                      .inputs = {},
                      .sources = {},
                      .out_dir = {},
                      .scratch_dir = options.scratch_dir,
                      .cores = job.cores,
                      .on_progress = options.on_progress});
  run(context, job.params);
}

Executed execute_job(const JobFile& job, const RunFunction& run, const ExecuteOptions& options) {
  const fs::path final_folder = artifact_folder(job.store, job.kind, job.key);
  if (auto manifest = read_valid_manifest(final_folder)) return {final_folder, std::move(*manifest), true};
  if (const std::string key = job_key(job); key != job.key)
    throw Error(ErrorKind::BadInput,
                fmt::format("job {}: key is {}, but its contents hash to {}", job.job, job.key, key));
  check_inputs(job, options.input_patience_ms);
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
