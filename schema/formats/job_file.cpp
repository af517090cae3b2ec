#include "schema/formats/job_file.h"

#include <fmt/format.h>

#include "schema/base/error.h"
#include "schema/base/hash.h"

namespace vantage {
namespace {

Json inputs_to_json(const std::map<std::string, JobFile::Input>& inputs) {
  Json out = Json::object();
  for (const auto& [name, input] : inputs) out[name] = {{"path", input.folder.string()}, {"content", input.content}};
  return out;
}

std::map<std::string, JobFile::Input> inputs_of(const Json& json) {
  std::map<std::string, JobFile::Input> out;
  for (const auto& [name, input] : json.items()) out[name] = {input.at("path").get<std::string>(), input.at("content")};
  return out;
}

Json contents_of(const std::map<std::string, JobFile::Input>& inputs) {
  Json out = Json::object();
  for (const auto& [name, input] : inputs) out[name] = input.content;
  return out;
}

}  // namespace

Json to_json(const JobFile& j) {
  return {{"format", 1},
          {"kind", j.kind},
          {"version", j.version},
          {"job", j.job},
          {"shot", j.shot},
          {"key", j.key},
          {"params", j.params},
          {"unit", j.unit},
          {"inputs", inputs_to_json(j.inputs)},
          {"sources", inputs_to_json(j.sources)},
          {"store", j.store.string()},
          {"cores", j.cores},
          {"ram_mb", j.ram_mb},
          {"timeout_s", j.timeout_s}};
}

JobFile read_job_file(const std::filesystem::path& path) {
  const Json j = read_json(path);
  try {
    JobFile f;
    f.kind = j.at("kind");
    f.version = j.at("version");
    f.job = j.at("job");
    f.shot = j.at("shot");
    f.key = j.at("key");
    f.params = j.at("params");
    f.unit = j.at("unit");
    f.inputs = inputs_of(j.at("inputs"));
    f.sources = inputs_of(j.at("sources"));
    f.store = j.at("store").get<std::string>();
    f.cores = j.at("cores");
    f.ram_mb = j.at("ram_mb");
    f.timeout_s = j.at("timeout_s");
    return f;
  } catch (const Json::exception& e) {
    throw Error(ErrorKind::BadInput, fmt::format("{}: is no job file: {}", path.string(), e.what()));
  }
}

std::string job_key(const JobFile& j) {
  const Json identity = {{"kind", j.kind},
                         {"version", j.version},
                         {"params", j.params},
                         {"unit", j.unit},
                         {"inputs", contents_of(j.inputs)},
                         {"sources", contents_of(j.sources)}};
  return sha256_key(identity.dump());
}

}  // namespace vantage
