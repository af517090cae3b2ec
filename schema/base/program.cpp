#include "schema/base/program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr int kNotStarted = 127;  // as shells say it

/// Between fork and exec only async-signal-safe calls are allowed: other threads may hold any lock.
[[noreturn]] void become(char* const* argv, const char* stdout_file, const char* stderr_file, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kNotStarted);
  const int in = open("/dev/null", O_RDONLY);
  const int err = *stderr_file != '\0' ? open(stderr_file, O_WRONLY | O_CREAT | O_APPEND, 0644) : STDERR_FILENO;
  const int out = *stdout_file != '\0' ? open(stdout_file, O_WRONLY | O_CREAT | O_TRUNC, 0644) : err;
  if (in < 0 || err < 0 || out < 0) _exit(kNotStarted);
  dup2(in, STDIN_FILENO);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  execvp(argv[0], argv);
  _exit(kNotStarted);
}

int wait_for(pid_t pid) {
  int status = 0;
  while (waitpid(pid, &status, 0) < 0)
    if (errno != EINTR) throw Error(ErrorKind::Transient, fmt::format("waitpid: {}", std::strerror(errno)));
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

int run_program(const std::vector<std::string>& argv, const ProgramOptions& options) {
  check(!argv.empty(), "a program has a name");
  std::vector<char*> words;
  for (const auto& word : argv) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  const std::string out = options.stdout_file.string(), err = options.stderr_file.string();
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid < 0)
    throw Error(ErrorKind::Resource, fmt::format("{}: cannot start a process: {}", argv[0], std::strerror(errno)));
  if (pid == 0) become(words.data(), out.c_str(), err.c_str(), parent);
  const int status = wait_for(pid);
  if (status == kNotStarted)
    throw Error(ErrorKind::Resource, fmt::format("{}: cannot be run; is the program installed?", argv[0]));
  return status;
}

}  // namespace vantage
