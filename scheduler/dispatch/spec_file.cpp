#include "scheduler/dispatch/spec_file.h"

#include <fmt/format.h>

#include <fstream>

#include "schema/base/error.h"
#include "schema/base/hash.h"

namespace vantage {

std::string write_spec_file(const std::filesystem::path& path, const JobFile& job) {
  const std::string text = to_json(job).dump(1) + "\n";
  std::filesystem::create_directories(path.parent_path());
  const std::filesystem::path temporary = path.string() + ".tmp";
  {
    std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
    out << text;
    out.close();
    if (!out) throw Error(ErrorKind::Resource, fmt::format("{}: cannot be written: is the disk full?", path.string()));
  }
  std::filesystem::rename(temporary, path);
  return hash_bytes(text);
}

}  // namespace vantage
