#pragma once
#include <filesystem>
#include <map>
#include <string>

#include "schema/base/json.h"

namespace vantage {

/// spec.json: one attempt of one job, complete: `vantage-worker exec spec.json` needs nothing else.
struct JobFile {
  std::string kind;
  int version = 0;
  std::string job;  ///< "correspond/cam0-000003__cam1-000004"
  std::string shot;
  std::string key;
  Json params = Json::object();
  Json unit = Json::object();
  struct Input {
    std::filesystem::path folder;  ///< absolute
    std::string content;           ///< the manifest's content hash that the key was made from
  };
  std::map<std::string, Input> inputs;   ///< by job name
  std::map<std::string, Input> sources;  ///< by source name; folder is the file's path
  std::filesystem::path store;           ///< SHOT/.vantage/store
  int cores = 1;
  int ram_mb = 1000;
  int timeout_s = 3600;
};

Json to_json(const JobFile& job);
/// Throws Error(BadInput) naming the file and what is missing.
JobFile read_job_file(const std::filesystem::path& path);
/// hash(kind, version, params, unit, contents of inputs and sources): the name of the result.
std::string job_key(const JobFile& job);

}  // namespace vantage
