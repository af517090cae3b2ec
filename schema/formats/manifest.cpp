#include "schema/formats/manifest.h"

#include <algorithm>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"

namespace vantage {
namespace fs = std::filesystem;

std::string content_hash(std::vector<Manifest::File> files) {
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.path < b.path; });
  std::string text;
  for (const auto& f : files) text += f.path + '\n' + f.xxh3 + '\n';
  return hash_bytes(text);
}

std::vector<Manifest::File> list_artifact_files(const fs::path& folder) {
  std::vector<Manifest::File> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string relative = entry.path().lexically_relative(folder).string();
    if (!entry.is_regular_file() || relative == "manifest.json") continue;
    files.push_back({relative, entry.file_size(), hash_file(entry.path())});
  }
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.path < b.path; });
  return files;
}

void write_manifest(const fs::path& folder, const Manifest& m) {
  Json files = Json::array();
  for (const auto& f : m.files) files.push_back({{"path", f.path}, {"size", f.size}, {"xxh3", f.xxh3}});
  write_json(folder / "manifest.json", {{"format", 1},
                                        {"kind", m.kind},
                                        {"version", m.version},
                                        {"job", m.job},
                                        {"key", m.key},
                                        {"content", m.content},
                                        {"files", files},
                                        {"figures", m.figures},
                                        {"provenance", m.provenance}});
}

std::optional<Manifest> read_valid_manifest(const fs::path& folder, bool check_hashes) {
  std::error_code error;
  if (!fs::is_regular_file(folder / "manifest.json", error)) return std::nullopt;
  try {
    const Json j = read_json(folder / "manifest.json");
    Manifest m{j.at("kind"), j.at("version"), j.at("job"),       j.at("key"), j.at("content"),
               {},           j.at("figures"), j.at("provenance")};
    for (const Json& f : j.at("files")) m.files.push_back({f.at("path"), f.at("size"), f.at("xxh3")});
    const auto written = fs::last_write_time(folder / "manifest.json");
    for (const auto& f : m.files) {
      const fs::path path = folder / f.path;
      if (fs::file_size(path, error) != f.size || error) return std::nullopt;
      const bool changed_since = fs::last_write_time(path) > written;
      if ((check_hashes || changed_since) && hash_file(path) != f.xxh3) return std::nullopt;
    }
    return content_hash(m.files) == m.content ? std::optional(m) : std::nullopt;
  } catch (const Json::exception&) {
    return std::nullopt;  // a manifest of another shape is no manifest of ours
  } catch (const Error&) {
    return std::nullopt;  // unreadable or no JSON: half-written is not believed
  } catch (const fs::filesystem_error&) {
    return std::nullopt;  // went away meanwhile
  }
}

fs::path artifact_folder(const fs::path& store, const std::string& kind, const std::string& key) {
  return store / kind / key;
}

}  // namespace vantage
