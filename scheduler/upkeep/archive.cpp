#include "scheduler/upkeep/archive.h"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>

#include "scheduler/farm/lock_file.h"
#include "scheduler/upkeep/verify.h"
#include "schema/base/clock.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "schema/base/json.h"
#include "schema/base/program.h"
#include "schema/formats/manifest.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr int kFormat = 1;
/// Maps and frames are packed already; more effort gains little and costs hours.
constexpr const char* kPacker = "zstd -T0 -6";

/// Removed with all that is in it.
class WorkFolder {
 public:
  explicit WorkFolder(const fs::path& beside)
      : path_(beside.parent_path() / fmt::format(".{}.{}", beside.filename().string(), to_hex(random_bytes(4)))) {
    fs::create_directories(path_);
  }
  ~WorkFolder() {
    std::error_code ignored;  // moved away, or a left-over that its name explains
    fs::remove_all(path_, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

void run_tar(const std::vector<std::string>& arguments, const std::string& doing) {
  std::vector<std::string> argv{"tar", "--use-compress-program", kPacker};
  argv.insert(argv.end(), arguments.begin(), arguments.end());
  if (const int code = run_program(argv, {.stdout_file = {}, .stderr_file = {}}); code != 0)
    throw Error(ErrorKind::Resource, fmt::format("{}: tar ended with exit code {}: is zstd installed (apt-get install "
                                                 "zstd), and the disk not full?",
                                                 doing, code));
}

void require_done(Sqlite& db, const fs::path& shot_folder) {
  const std::string state = db.text_or("", "SELECT state FROM shot WHERE folder = ?", shot_folder.string());
  if (state != "done")
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: is {}, only a shot that is done is archived", shot_folder.string(),
                            state.empty() ? "not known to this farm" : state));
}

Json job_table(Sqlite& db, const fs::path& shot_folder) {
  Json jobs = Json::array();
  for (Query q = db.query("SELECT j.name, j.kind, j.version, j.state, j.key, j.content, j.params, j.unit, j.sources, "
                          "j.num_attempts, j.wall_ms, j.peak_rss_mb, j.finished_ms FROM job j JOIN shot s "
                          "ON s.id = j.shot_id WHERE s.folder = ? AND j.generation = s.generation ORDER BY j.id",
                          shot_folder.string());
       q.step();)
    jobs.push_back({{"name", q.text(0)},
                    {"kind", q.text(1)},
                    {"version", q.integer(2)},
                    {"state", q.text(3)},
                    {"key", q.text(4)},
                    {"content", q.text(5)},
                    {"params", Json::parse(q.text(6))},
                    {"unit", Json::parse(q.text(7))},
                    {"sources", Json::parse(q.text(8))},
                    {"num_attempts", q.integer(9)},
                    {"wall_ms", q.integer(10)},
                    {"peak_rss_mb", q.integer(11)},
                    {"finished_ms", q.integer(12)}});
  return jobs;
}

/// So that a person can tell years later whether a file is the one that was used.
Json footage_of(const Json& jobs) {
  Json footage = Json::object();
  for (const Json& job : jobs)
    for (const Json& source : job.at("sources")) {
      const std::string path = source.at("path");
      std::error_code gone;
      if (!footage.contains(path))
        footage[path] = fs::is_regular_file(path, gone) ? Json(hash_file(path)) : Json(nullptr);
    }
  return footage;
}

std::string artifact_path(const PlannedArtifact& artifact) {
  return (fs::path(".vantage") / "store" / artifact.kind / artifact.key).string();
}

/// Every artifact that jobs.json names is there, and its bytes are those of its manifest.
ArchiveFacts check_unpacked(const fs::path& folder) {
  const Json about = read_json(folder / "archive.json");
  if (about.value("format", 0) != kFormat)
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: is of format {}, expected {}", folder.string(), about.value("format", 0), kFormat));
  ArchiveFacts facts{.shot = about.at("shot")};
  for (const Json& job : read_json(folder / "jobs.json")) {
    ++facts.num_jobs;
    const std::string content = job.at("content");
    if (content.empty() || content == "nothing") continue;
    ++facts.num_artifacts;
    const std::string why =
        why_damaged(artifact_folder(folder / ".vantage" / "store", job.at("kind"), job.at("key")), content);
    if (!why.empty()) throw Error(ErrorKind::BadInput, fmt::format("{}: {}", job.at("name").get<std::string>(), why));
  }
  return facts;
}

/// Those into the store, which would point to nothing.
void remove_links(const fs::path& out) {
  std::vector<fs::path> links;
  std::error_code none;
  for (const auto& entry : fs::recursive_directory_iterator(out, none))
    if (entry.is_symlink() && fs::read_symlink(entry.path()).string().find(".vantage/store/") != std::string::npos)
      links.push_back(entry.path());
  for (const fs::path& link : links) fs::remove(link);
}

}  // namespace

ArchiveFacts pack_shot(const fs::path& shot_folder, const fs::path& state_dir, const fs::path& to_file) {
  if (fs::exists(to_file)) throw Error(ErrorKind::BadInput, fmt::format("{}: is there already", to_file.string()));
  Sqlite db = open_farm_to_read(state_dir);
  require_done(db, shot_folder);
  const auto artifacts = finished_artifacts(db, shot_folder);
  const WorkFolder work(fs::absolute(to_file));
  const Json jobs = job_table(db, shot_folder);
  write_json(work.path() / "jobs.json", jobs);
  write_json(work.path() / "archive.json", {{"format", kFormat},
                                            {"shot", shot_folder.filename().string()},
                                            {"folder", shot_folder.string()},
                                            {"farm_id", db.text_or("", "SELECT value FROM meta WHERE key = 'farm_id'")},
                                            {"at_ms", system_clock().wall_ms()},
                                            {"footage", footage_of(jobs)}});
  std::string list = "shot.toml\n";
  if (fs::exists(shot_folder / "out")) list += "out\n";
  for (const auto& artifact : artifacts) list += artifact_path(artifact) + "\n";
  write_file_atomically(work.path() / "list", list);
  const fs::path packed = work.path() / "packed", unpacked = work.path() / "unpacked";
  run_tar({"--create", "--dereference", "--file", packed.string(), "--directory", work.path().string(), "archive.json",
           "jobs.json", "--directory", shot_folder.string(), "--files-from", (work.path() / "list").string()},
          to_file.string());
  fs::create_directories(unpacked);
  run_tar({"--extract", "--file", packed.string(), "--directory", unpacked.string()}, to_file.string());
  ArchiveFacts facts = check_unpacked(unpacked);
  facts.num_bytes = fs::file_size(packed);
  fsync_path(packed);
  fs::rename(packed, to_file);
  fsync_path(fs::absolute(to_file).parent_path());
  return facts;
}

ArchiveFacts unpack_shot(const fs::path& file, const fs::path& to_folder) {
  if (!fs::is_regular_file(file)) throw Error(ErrorKind::BadInput, fmt::format("{}: no such archive", file.string()));
  if (fs::exists(to_folder) && !fs::is_empty(to_folder))
    throw Error(ErrorKind::BadInput, fmt::format("{}: is there already and not empty", to_folder.string()));
  const WorkFolder work(fs::absolute(to_folder));
  run_tar({"--extract", "--file", file.string(), "--directory", work.path().string()}, file.string());
  ArchiveFacts facts;
  try {
    facts = check_unpacked(work.path());
  } catch (const Error& e) {
    throw Error(ErrorKind::BadInput, fmt::format("{}: damaged: {}", file.string(), e.what()));
  }
  facts.num_bytes = fs::file_size(file);
  std::error_code empty_or_none;
  fs::remove(to_folder, empty_or_none);
  fs::rename(work.path(), to_folder);
  return facts;
}

void remove_archived(const fs::path& shot_folder) {
  const fs::path inner = shot_folder / ".vantage", own = inner / "farm";
  if (fs::is_symlink(inner) || fs::is_symlink(inner / "store"))
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: is shared with other shots and stays; 'vantage gc' removes what none can reach",
                            (inner / "store").string()));
  const LockFile nobody_works((fs::exists(own) ? own : inner) / "lock");
  remove_links(shot_folder / "out");
  for (const char* part : {"store", "specs", "logs"}) fs::remove_all(inner / part);
}

}  // namespace vantage
