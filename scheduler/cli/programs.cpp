#include "scheduler/cli/programs.h"

#include <fmt/format.h>
#include <unistd.h>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/program.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr int kProbeFoundBadFootage = 2;

/// A folder of our own in the system's place for such, removed at the end.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (fs::temp_directory_path() / "vantage-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr)
      throw Error(ErrorKind::Resource, fmt::format("cannot make a folder in {}", fs::temp_directory_path().string()));
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

fs::path sibling_program(const std::string& name) {
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / name;
  if (!fs::exists(program))
    throw Error(ErrorKind::Resource,
                fmt::format("{} is missing: it belongs beside the program vantage", program.string()));
  return program;
}

Json probe_footage_files(const std::vector<std::string>& footage) {
  const TemporaryFolder folder;
  std::vector<std::string> argv{sibling_program("vantage-worker").string(), "probe", "--json"};
  argv.insert(argv.end(), footage.begin(), footage.end());
  const fs::path answer = folder.path() / "probe.json";
  // Decoders write their own complaints to stderr; what matters of them is in the answer.
  const int status = run_program(argv, {.stdout_file = answer, .stderr_file = folder.path() / "stderr.txt"});
  if (status != 0 && status != kProbeFoundBadFootage)
    throw Error(ErrorKind::Resource, fmt::format("{} probe ended with status {}: {}", argv[0], status,
                                                 read_file(folder.path() / "stderr.txt")));
  return read_json(answer);
}

}  // namespace vantage
