#include "worker/run_table.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

bool is_on_path(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "/usr/local/bin:/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (access((folder + "/" + program).c_str(), X_OK) == 0) return true;
  return false;
}

std::vector<std::string> missing_programs(const KindSpec& spec) {
  std::istringstream programs{std::string(spec.programs)};
  std::vector<std::string> missing;
  for (std::string program; programs >> program;)
    if (!is_on_path(program)) missing.push_back(program);
  return missing;
}

}  // namespace

const RunEntry& find_run(const RunTable& table, const std::string& kind, int version) {
  std::vector<std::string> names;
  for (const RunEntry& entry : table) {
    names.emplace_back(entry.spec.name);
    if (entry.spec.name != kind) continue;
    if (entry.spec.version != version)
      throw Error(ErrorKind::Transient, fmt::format("job wants version {} of {}, this worker has version {}", version,
                                                    kind, entry.spec.version));
    return entry;
  }
  throw Error(ErrorKind::BadInput, fmt::format("no job kind '{}'{}", kind, did_you_mean(kind, names)));
}

std::string kind_and_version(const KindSpec& spec) { return fmt::format("{}/{}", spec.name, spec.version); }

Capabilities capabilities_of(const RunTable& table) {
  Capabilities out;
  for (const RunEntry& entry : table) {
    const auto missing = missing_programs(entry.spec);
    if (missing.empty()) out.kinds.push_back(kind_and_version(entry.spec));
    for (const std::string& program : missing)
      out.missing.push_back(fmt::format("{} needs the program '{}', which is not on PATH", entry.spec.name, program));
  }
  return out;
}

}  // namespace vantage
