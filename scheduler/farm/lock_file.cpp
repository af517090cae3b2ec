#include "scheduler/farm/lock_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {

LockFile::LockFile(const std::filesystem::path& path) : fd_(open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
  if (fd_ < 0)
    throw Error(ErrorKind::BadInput, fmt::format("{}: cannot be opened: {}", path.string(), std::strerror(errno)));
  if (flock(fd_, LOCK_EX | LOCK_NB) != 0) {
    close(fd_);
    std::string pid = read_file(path);
    while (!pid.empty() && pid.back() == '\n') pid.pop_back();
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: another scheduler (process {}) works here; stop it, or ask it with `vantage submit`",
                            path.parent_path().string(), pid.empty() ? "unknown" : pid));
  }
  const std::string text = fmt::format("{}\n", getpid());
  if (ftruncate(fd_, 0) != 0 || pwrite(fd_, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size())) {
    close(fd_);
    throw Error(ErrorKind::Resource, fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno)));
  }
}

LockFile::~LockFile() { close(fd_); }

}  // namespace vantage
