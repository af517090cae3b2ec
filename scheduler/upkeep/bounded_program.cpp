#include "scheduler/upkeep/bounded_program.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "schema/base/error.h"

extern char** environ;

namespace vantage {
namespace {

constexpr int kCouldNotStart = 127;

/// A file in memory: nothing has to be drained while the program runs, and a program that reads nothing stops nobody.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view content = "") : fd_(memfd_create("vantage", MFD_CLOEXEC)) {
    check(fd_ >= 0, "a file in memory can be made");
    if (pwrite(fd_, content.data(), content.size(), 0) != static_cast<ssize_t>(content.size()))
      throw Error(ErrorKind::Resource, "out of memory for a program's input");
  }
  ~MemoryFile() { close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  int fd() const { return fd_; }
  std::string start() const {
    std::array<char, 4096> buffer{};
    const ssize_t size = pread(fd_, buffer.data(), buffer.size(), 0);
    return {buffer.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0))};
  }

 private:
  int fd_;
};

/// Its own process group, so that what it starts can be ended with it. 0 when it cannot be started; errno says why.
pid_t start(const std::vector<std::string>& argv, int in, int out) {
  std::vector<char*> arguments;
  for (const auto& argument : argv) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, in, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, out, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, out, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
  pid_t pid = 0;
  const int error = posix_spawnp(&pid, arguments[0], &files, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  errno = error;
  return error == 0 ? pid : 0;
}

bool ends_in_time(pid_t pid, int timeout_ms) {
  const int pid_fd = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  if (pid_fd < 0) return false;
  pollfd p{.fd = pid_fd, .events = POLLIN, .revents = 0};
  const bool ended = poll(&p, 1, timeout_ms) == 1;
  close(pid_fd);
  return ended;
}

}  // namespace

BoundedRun run_bounded(const std::vector<std::string>& argv, std::string_view input, int timeout_ms) {
  const MemoryFile in(input), out;
  BoundedRun run;
  const pid_t pid = start(argv, in.fd(), out.fd());
  if (pid == 0) {
    run.exit_code = kCouldNotStart;
    run.output = fmt::format("{}: cannot be started: {}", argv[0], std::strerror(errno));
    return run;
  }
  run.timed_out = !ends_in_time(pid, timeout_ms);
  kill(-pid, SIGKILL);  // before it is reaped: until then the group's number is its own
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) continue;
  run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  run.output = out.start();
  return run;
}

}  // namespace vantage
