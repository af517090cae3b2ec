#include "scheduler/publish/publisher.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "schema/base/files.h"
#include "schema/base/json.h"
#include "schema/formats/manifest.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

/// Ours are known by where they point: nobody else has a reason to link into the store.
bool is_ours(const fs::path& path) {
  std::error_code error;
  if (!fs::is_symlink(path, error)) return false;
  return fs::read_symlink(path, error).string().find(".vantage/store/") != std::string::npos && !error;
}

/// "" for the whole artifact, else without a leading "./".
std::string folder_prefix(const std::string& from) {
  return from == "/" || from == "./" ? "" : from.rfind("./", 0) == 0 ? from.substr(2) : from;
}

void add_link(const fs::path& out, const fs::path& artifact, const std::string& file, const fs::path& to,
              std::vector<PublishedLink>& links) {
  const fs::path link = (out / to).lexically_normal();
  links.push_back({link, (artifact / file).lexically_relative(link.parent_path())});
}

void remove_empty_folders(const fs::path& root) {
  std::vector<fs::path> folders;
  for (const auto& entry : fs::recursive_directory_iterator(root))
    if (entry.is_directory() && !entry.is_symlink()) folders.push_back(entry.path());
  for (auto folder = folders.rbegin(); folder != folders.rend(); ++folder)
    if (fs::is_empty(*folder)) fs::remove(*folder);
}

void sweep_out(const fs::path& out, const std::set<fs::path>& owned) {
  std::vector<fs::path> stale;
  for (const auto& entry : fs::recursive_directory_iterator(out))
    if (is_ours(entry.path()) && !owned.contains(entry.path())) stale.push_back(entry.path());
  for (const auto& link : stale) fs::remove(link);
  if (!stale.empty()) remove_empty_folders(out);
}

}  // namespace

std::vector<PublishedLink> links_of(const fs::path& shot_folder, const JobRow& job) {
  std::vector<PublishedLink> links;
  const Json wanted = Json::parse(job.links);
  if (wanted.empty()) return links;
  const fs::path artifact = artifact_folder(shot_folder / ".vantage" / "store", job.kind, job.key);
  const auto manifest = read_valid_manifest(artifact);
  if (!manifest) return links;
  const fs::path out = shot_folder / "out";
  for (const Json& link : wanted) {
    const std::string from = link.at("from"), to = link.at("to");
    const bool whole_folder = from.empty() || from.back() == '/';
    const std::string prefix = folder_prefix(from);
    for (const auto& file : manifest->files) {
      if (whole_folder && file.path.rfind(prefix, 0) == 0)
        add_link(out, artifact, file.path, fs::path(to) / file.path.substr(prefix.size()), links);
      if (!whole_folder && file.path == prefix)
        add_link(out, artifact, file.path,
                 to.back() == '/' ? fs::path(to) / fs::path(file.path).filename() : fs::path(to), links);
    }
  }
  return links;
}

std::vector<fs::path> make_links(const std::vector<PublishedLink>& links, const std::string& job_name) {
  std::vector<fs::path> in_the_way;
  for (const auto& [link, target] : links) {
    const bool there = fs::exists(fs::symlink_status(link));
    if (there && !is_ours(link)) {
      spdlog::warn("{}: is not ours and stays; {} is not linked", link.string(), job_name);
      in_the_way.push_back(link);
      continue;
    }
    fs::create_directories(link.parent_path());
    replace_symlink(target, link);
  }
  return in_the_way;
}

std::vector<fs::path> publish_job(const fs::path& shot_folder, const JobRow& job) {
  return make_links(links_of(shot_folder, job), job.name);
}

void publish_shot(Store& store, ShotId shot, bool sweep) {
  const ShotRow row = *store.shot(shot);
  std::set<fs::path> owned;
  for (const JobRow& job : store.good_jobs_of(shot)) {
    const auto links = links_of(row.folder, job);
    make_links(links, job.name);
    for (const auto& link : links) owned.insert(link.link);
  }
  if (sweep && fs::exists(row.folder / "out")) sweep_out(row.folder / "out", owned);
}

}  // namespace vantage
