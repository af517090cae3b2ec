#include "schema/messages/quiet_stderr.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <sstream>
#include <string>

namespace vantage {
namespace {
std::mutex& stderr_mutex() {
  static std::mutex mutex;
  return mutex;
}

std::string contents_of(int fd) {
  std::string text;
  char buffer[4096];
  lseek(fd, 0, SEEK_SET);
  for (ssize_t n = 0; (n = read(fd, buffer, sizeof buffer)) > 0;) text.append(buffer, static_cast<std::size_t>(n));
  return text;
}
}  // namespace

QuietStderr::QuietStderr() : one_at_a_time_(stderr_mutex()) {
  held_fd_ = memfd_create("stderr", MFD_CLOEXEC);
  stderr_fd_ = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
  if (held_fd_ >= 0 && stderr_fd_ >= 0) dup2(held_fd_, STDERR_FILENO);
}

QuietStderr::~QuietStderr() {
  if (held_fd_ >= 0 && stderr_fd_ >= 0) {
    dup2(stderr_fd_, STDERR_FILENO);
    std::istringstream lines(contents_of(held_fd_));
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("LCM tcpq") || line.starts_with("lcm_tcpq")) continue;
      line += '\n';
      [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, line.data(), line.size());
    }
  }
  if (held_fd_ >= 0) close(held_fd_);
  if (stderr_fd_ >= 0) close(stderr_fd_);
}

}  // namespace vantage
