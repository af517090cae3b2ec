#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "schema/base/json.h"

namespace vantage {

/// manifest.json of an artifact folder SHOT/.vantage/store/<kind>/<key>/. Written last, so a folder with a manifest is
/// complete; the folder gets its final name by one rename.
struct Manifest {
  struct File {
    std::string path;  ///< relative to the folder
    std::uintmax_t size = 0;
    std::string xxh3;
  };
  std::string kind;
  int version = 0;
  std::string job;      ///< job name in the shot that made it first
  std::string key;      ///< hash of kind, version, params, unit and input contents
  std::string content;  ///< hash of paths and hashes of all files: equal for equal outputs
  std::vector<File> files;
  Json figures = Json::object();     ///< what JobContext::figure() collected
  Json provenance = Json::object();  ///< params, unit, inputs, host, build, wall_s, peak_rss_mb: not part of content
};

/// Hash of the list of paths and hashes, order of the list aside.
std::string content_hash(std::vector<Manifest::File> files);
/// Files below a folder (manifest.json left out), hashed, sorted by path.
std::vector<Manifest::File> list_artifact_files(const std::filesystem::path& folder);
void write_manifest(const std::filesystem::path& folder, const Manifest& manifest);
/// Empty when the folder has no manifest, or one that is no manifest, or a listed file is missing or has another size.
/// Files that were changed after the manifest was written are read and compared with their hash; with check_hashes
/// every file is.
std::optional<Manifest> read_valid_manifest(const std::filesystem::path& folder, bool check_hashes = false);

/// SHOT/.vantage/store/<kind>/<key>
std::filesystem::path artifact_folder(const std::filesystem::path& store, const std::string& kind,
                                      const std::string& key);

}  // namespace vantage
