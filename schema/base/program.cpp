#include "schema/base/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include "schema/base/error.h"
#include "schema/base/program_pipe.h"
#include "schema/base/program_sink.h"

namespace vantage {
namespace {

constexpr int kNotStarted = 127;  // as shells say it

/// Where a program's input comes from, and where its output goes: a file; nowhere: with stderr.
struct Streams {
  const char* stdout_file = "";
  const char* stderr_file = "";  ///< "": our own stderr
  int stdout_fd = -1;            ///< instead of stdout_file
  int stdin_fd = -1;             ///< -1: empty
};

/// Between fork and exec only async-signal-safe calls are allowed: other threads may hold any lock.
[[noreturn]] void become(char* const* argv, const Streams& streams, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kNotStarted);
  const int in = streams.stdin_fd >= 0 ? streams.stdin_fd : open("/dev/null", O_RDONLY);
  const int err =
      *streams.stderr_file != '\0' ? open(streams.stderr_file, O_WRONLY | O_CREAT | O_APPEND, 0644) : STDERR_FILENO;
  const int out = streams.stdout_fd >= 0         ? streams.stdout_fd
                  : *streams.stdout_file != '\0' ? open(streams.stdout_file, O_WRONLY | O_CREAT | O_TRUNC, 0644)
                                                 : err;
  if (in < 0 || err < 0 || out < 0) _exit(kNotStarted);
  dup2(in, STDIN_FILENO);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  execvp(argv[0], argv);
  _exit(kNotStarted);
}

pid_t start(const std::vector<std::string>& argv, const Streams& streams) {
  check(!argv.empty(), "a program has a name");
  std::vector<char*> words;
  for (const auto& word : argv) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid < 0)
    throw Error(ErrorKind::Resource, fmt::format("{}: cannot start a process: {}", argv[0], std::strerror(errno)));
  if (pid == 0) become(words.data(), streams, parent);
  return pid;
}

int wait_for(pid_t pid, const std::string& name) {
  int status = 0;
  while (waitpid(pid, &status, 0) < 0)
    if (errno != EINTR) throw Error(ErrorKind::Transient, fmt::format("waitpid: {}", std::strerror(errno)));
  if (WIFEXITED(status) && WEXITSTATUS(status) == kNotStarted)
    throw Error(ErrorKind::Resource, fmt::format("{}: cannot be run; is the program installed?", name));
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

int run_program(const std::vector<std::string>& argv, const ProgramOptions& options) {
  const std::string out = options.stdout_file.string(), err = options.stderr_file.string();
  const pid_t pid = start(argv, {.stdout_file = out.c_str(), .stderr_file = err.c_str()});
  return wait_for(pid, argv[0]);
}

ProgramPipe::ProgramPipe(const std::vector<std::string>& argv, const std::filesystem::path& stderr_file) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0)
    throw Error(ErrorKind::Resource, fmt::format("cannot make a pipe: {}", std::strerror(errno)));
  fd_ = ends[0];
  // Fewer turns between the two programs; the system may allow less.
  fcntl(fd_, F_SETPIPE_SZ, 1 << 20);
  const std::string err = stderr_file.string();
  pid_ = start(argv, {.stderr_file = err.c_str(), .stdout_fd = ends[1]});
  name_ = argv[0];
  close(ends[1]);
}

ProgramPipe::~ProgramPipe() {
  if (fd_ >= 0) close(fd_);
  if (pid_ < 0) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

std::size_t ProgramPipe::read(char* bytes, std::size_t num) {
  std::size_t done = 0;
  while (done < num) {
    const ssize_t got = ::read(fd_, bytes + done, num - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw Error(ErrorKind::Transient, fmt::format("{}: reading from it: {}", name_, std::strerror(errno)));
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

int ProgramPipe::wait() {
  check(pid_ >= 0, "a program is waited for once");
  return wait_for(std::exchange(pid_, -1), name_);
}

ProgramSink::ProgramSink(const std::vector<std::string>& argv, const std::filesystem::path& stderr_file) {
  std::array<int, 2> ends{};  // of a socket: writing to a program that has ended is no signal there
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw Error(ErrorKind::Resource, fmt::format("cannot make a socket: {}", std::strerror(errno)));
  fd_ = ends[0];
  const std::string err = stderr_file.string();
  pid_ = start(argv, {.stderr_file = err.c_str(), .stdin_fd = ends[1]});
  name_ = argv[0];
  close(ends[1]);
}

ProgramSink::~ProgramSink() {
  if (fd_ >= 0) close(fd_);
  if (pid_ < 0) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

bool ProgramSink::write(const char* bytes, std::size_t num) {
  for (std::size_t done = 0; done < num;) {
    const ssize_t put = ::send(fd_, bytes + done, num - done, MSG_NOSIGNAL);
    if (put < 0 && errno == EINTR) continue;
    if (put < 0 && (errno == EPIPE || errno == ECONNRESET)) return false;
    if (put < 0) throw Error(ErrorKind::Transient, fmt::format("{}: writing to it: {}", name_, std::strerror(errno)));
    done += static_cast<std::size_t>(put);
  }
  return true;
}

int ProgramSink::finish() {
  check(pid_ >= 0, "a program is waited for once");
  close(std::exchange(fd_, -1));
  return wait_for(std::exchange(pid_, -1), name_);
}

}  // namespace vantage
