#include "scheduler/upkeep/verify.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>

#include "scheduler/dispatch/spec_file.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "schema/base/program.h"
#include "schema/formats/job_file.h"
#include "schema/formats/manifest.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

/// Removed with all that is in it.
class TemporaryStore {
 public:
  explicit TemporaryStore(const fs::path& shot_folder)
      : path_(shot_folder / ".vantage" / fmt::format("verify.{}.{}", getpid(), to_hex(random_bytes(4)))) {
    fs::create_directories(path_);
  }
  ~TemporaryStore() {
    std::error_code ignored;  // a left-over is named so that a person knows what it is
    fs::remove_all(path_, ignored);
  }
  TemporaryStore(const TemporaryStore&) = delete;
  TemporaryStore& operator=(const TemporaryStore&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::map<std::string, JobFile::Input> inputs_of(Sqlite& db, std::int64_t job_id, const fs::path& store) {
  std::map<std::string, JobFile::Input> inputs;
  for (Query q = db.query("SELECT j.name, j.kind, j.key, j.content FROM dependency d JOIN job j ON j.id = d.needs_id "
                          "WHERE d.job_id = ?",
                          job_id);
       q.step();)
    inputs[q.text(0)] = {artifact_folder(store, q.text(1), q.text(2)), q.text(3)};
  return inputs;
}

std::map<std::string, JobFile::Input> sources_of(const Json& sources) {
  std::map<std::string, JobFile::Input> files;
  for (const Json& source : sources) {
    const fs::path path = source.at("path").get<std::string>();
    files[source.at("name")] = {path, hash_file(path)};
  }
  return files;
}

/// The job as the farm would order it now. Throws Error(BadInput) when that would be another one.
JobFile job_file_of(Sqlite& db, const PlannedArtifact& artifact, const fs::path& shot_folder) {
  Query q = db.query(
      "SELECT j.version, j.params, j.unit, j.sources, j.cores, j.ram_mb, j.timeout_s, s.name FROM job j "
      "JOIN shot s ON s.id = j.shot_id WHERE j.id = ?",
      artifact.job_id);
  check(q.step(), "the job was just listed");
  JobFile job;
  job.kind = artifact.kind;
  job.version = static_cast<int>(q.integer(0));
  job.job = artifact.job;
  job.shot = q.text(7);
  job.key = artifact.key;
  job.params = Json::parse(q.text(1));
  job.unit = Json::parse(q.text(2));
  job.inputs = inputs_of(db, artifact.job_id, shot_folder / ".vantage" / "store");
  job.sources = sources_of(Json::parse(q.text(3)));
  job.cores = static_cast<int>(q.integer(4));
  job.ram_mb = static_cast<int>(q.integer(5));
  job.timeout_s = static_cast<int>(q.integer(6));
  if (job_key(job) != job.key)
    throw Error(ErrorKind::BadInput, "footage or inputs have changed since; 'vantage run' brings it up to date");
  return job;
}

std::string last_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') == std::string::npos ? 0 : text.rfind('\n') + 1);
}

}  // namespace

std::vector<PlannedArtifact> finished_artifacts(Sqlite& db, const fs::path& shot_folder) {
  const std::int64_t shot = db.integer_or(-1, "SELECT id FROM shot WHERE folder = ?", shot_folder.string());
  if (shot < 0)
    throw Error(ErrorKind::BadInput, fmt::format("{}: farm {} does not know this shot", shot_folder.string(),
                                                 db.file().parent_path().string()));
  std::vector<PlannedArtifact> artifacts;
  for (Query q = db.query("SELECT j.id, j.name, j.kind, j.key, j.content FROM job j JOIN shot s ON s.id = j.shot_id "
                          "WHERE j.shot_id = ? AND j.generation = s.generation AND j.state IN ('done', 'skipped') "
                          "AND j.content <> 'nothing' ORDER BY j.stage, j.name",
                          shot);
       q.step();)
    artifacts.push_back({q.integer(0), q.text(1), q.text(2), q.text(3), q.text(4)});
  return artifacts;
}

std::string why_damaged(const fs::path& folder, const std::string& content) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) return "is not there";
  if (!fs::exists(folder / "manifest.json", error)) return "has no manifest.json";
  Manifest manifest;
  try {
    const Json j = read_json(folder / "manifest.json");
    for (const Json& f : j.at("files")) manifest.files.push_back({f.at("path"), f.at("size"), f.at("xxh3")});
    manifest.content = j.at("content");
  } catch (const std::exception& e) {
    return fmt::format("manifest.json: {}", e.what());
  }
  for (const auto& file : manifest.files) {
    const fs::path path = folder / file.path;
    if (!fs::exists(path, error)) return fmt::format("{}: is not there", file.path);
    const auto size = fs::file_size(path, error);
    if (size != file.size) return fmt::format("{}: has {} bytes, expected {}", file.path, size, file.size);
    if (const std::string hash = hash_file(path); hash != file.xxh3)
      return fmt::format("{}: has hash {}, expected {}", file.path, hash, file.xxh3);
  }
  if (content_hash(manifest.files) != manifest.content) return "manifest.json: its own hashes do not agree";
  if (manifest.content != content) return fmt::format("has content {}, the farm expects {}", manifest.content, content);
  return "";
}

void move_damaged_aside(const fs::path& store, const PlannedArtifact& artifact) {
  const fs::path from = artifact_folder(store, artifact.kind, artifact.key);
  if (!fs::exists(from)) return;
  char host[256] = {};
  gethostname(host, sizeof host - 1);
  fs::create_directories(store / ".tmp");
  fs::rename(
      from, store / ".tmp" / fmt::format("damaged-{}.{}.{}.{}", artifact.key, host, getpid(), to_hex(random_bytes(4))));
}

Recomputed recompute(Sqlite& db, const PlannedArtifact& artifact, const fs::path& shot_folder,
                     const fs::path& worker_program) {
  const auto start = std::chrono::steady_clock::now();
  Recomputed result;
  try {
    JobFile job = job_file_of(db, artifact, shot_folder);
    const TemporaryStore temporary(shot_folder);
    job.store = temporary.path() / "store";
    const fs::path spec = temporary.path() / "spec.json", log = temporary.path() / "log";
    write_spec_file(spec, spec_text(job));
    const int code = run_program({worker_program.string(), "exec", spec.string()},
                                 {.stdout_file = temporary.path() / "stdout", .stderr_file = log});
    const auto manifest = read_valid_manifest(artifact_folder(job.store, job.kind, job.key), /*check_hashes=*/true);
    if (manifest)
      result = {manifest->content == artifact.content ? Recomputed::Verdict::Same : Recomputed::Verdict::Differs,
                manifest->content};
    else
      result.text = fmt::format("exit code {}: {}", code, fs::exists(log) ? last_line(read_file(log)) : "");
  } catch (const Error& e) {
    if (e.kind() == ErrorKind::Bug) throw;
    result.text = e.what();
  }
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace vantage
