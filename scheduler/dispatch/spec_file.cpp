#include "scheduler/dispatch/spec_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "schema/base/error.h"

namespace vantage {

std::string spec_text(const JobFile& job) { return to_json(job).dump(1) + "\n"; }

void write_spec_file(const std::filesystem::path& path, const std::string& text) {
  const auto open_it = [&] { return open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666); };
  int fd = open_it();
  if (fd < 0 && errno == ENOENT) {
    std::error_code ignored;  // open says it better
    std::filesystem::create_directories(path.parent_path(), ignored);
    fd = open_it();
  }
  const bool written = fd >= 0 && write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const int why = errno;
  if ((fd < 0 || close(fd) == 0) && written) return;
  throw Error(ErrorKind::Resource, fmt::format("{}: cannot be written: {}", path.string(), std::strerror(why)));
}

}  // namespace vantage
