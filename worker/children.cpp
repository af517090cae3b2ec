#include "worker/children.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "schema/base/error.h"
#include "worker/machine.h"

namespace vantage {
namespace {

constexpr int kCannotExec = 127;

/// Between fork and exec in a process that had threads: system calls only, nothing that may take a lock or allocate.
[[noreturn]] void become(char* const* argv, int log_fd, pid_t parent) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kCannotExec);  // the worker died before the line above
  if (const int fd = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC); fd >= 0) {
    [[maybe_unused]] const ssize_t written = write(fd, "500", 3);
    close(fd);
  }
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  for (const int s : {SIGPIPE, SIGHUP, SIGINT, SIGTERM, SIGCHLD}) signal(s, SIG_DFL);  // LCM ignores SIGPIPE
  const int null_fd = open("/dev/null", O_RDONLY);
  dup2(null_fd, STDIN_FILENO);
  dup2(log_fd, STDOUT_FILENO);
  dup2(log_fd, STDERR_FILENO);
  close_range(3, ~0U, 0);  // LCM's sockets would keep the bus connection open after the worker's death
  execv(argv[0], argv);
  _exit(kCannotExec);
}

int open_log(const std::filesystem::path& path) {
  std::error_code ignored;  // open() below says it better
  std::filesystem::create_directories(path.parent_path(), ignored);
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (fd < 0)
    throw Error(ErrorKind::Transient, fmt::format("{}: cannot open the log: {}", path.string(), std::strerror(errno)));
  return fd;
}

}  // namespace

Children::~Children() {
  for (auto& [ref, child] : children_) {
    kill(-child.pid, SIGKILL);
    waitpid(child.pid, nullptr, 0);
    if (child.pid_fd >= 0) close(child.pid_fd);
  }
}

void Children::start(const ChildCommand& command) {
  check(!command.argv.empty() && !children_.contains(command.ref), "an attempt has one child and a program to run");
  if (access(command.argv[0].c_str(), X_OK) != 0)
    throw Error(ErrorKind::Transient, fmt::format("{}: cannot run it: {}", command.argv[0], std::strerror(errno)));
  std::vector<char*> argv;
  for (const std::string& a : command.argv) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  const int log_fd = open_log(command.log_path);
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) become(argv.data(), log_fd, parent);
  const int why = errno;
  close(log_fd);
  if (pid < 0) throw Error(ErrorKind::Resource, fmt::format("cannot start a process: {}", std::strerror(why)));
  setpgid(pid, pid);  // here as well, or a signal to the group could come before the group is
  const int pid_fd = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  children_[command.ref] = {pid, pid_fd, std::chrono::steady_clock::now(), 0, num_oom_kills()};
}

void Children::signal_group(const AttemptRef& ref, int signal) {
  if (const auto found = children_.find(ref); found != children_.end()) kill(-found->second.pid, signal);
}

Children::Ended Children::ended(const AttemptRef& ref, const Child& child, int status, std::int32_t max_rss_mb) const {
  Ended e{.ref = ref, .pid = child.pid};
  if (WIFSIGNALED(status))
    e.signal = WTERMSIG(status);
  else
    e.exit_code = WEXITSTATUS(status);
  const auto wall = std::chrono::steady_clock::now() - child.start;
  e.wall_ms = std::chrono::duration_cast<std::chrono::milliseconds>(wall).count();
  e.peak_rss_mb = std::max(child.peak_rss_mb, max_rss_mb);
  e.out_of_memory = num_oom_kills() > child.oom_kills_before;
  return e;
}

std::vector<Children::Ended> Children::reap() {
  std::vector<Ended> out;
  for (auto it = children_.begin(); it != children_.end();) {
    const Child& child = it->second;
    int status = 0;
    rusage usage{};
    if (wait4(child.pid, &status, WNOHANG, &usage) != child.pid) {
      ++it;
      continue;
    }
    kill(-child.pid, SIGKILL);  // grandchildren that outlived it would write into folders that are gone
    out.push_back(ended(it->first, child, status, static_cast<std::int32_t>(usage.ru_maxrss / 1024)));
    if (child.pid_fd >= 0) close(child.pid_fd);
    it = children_.erase(it);
  }
  return out;
}

std::vector<AttemptRef> Children::running() const {
  std::vector<AttemptRef> out;
  for (const auto& [ref, child] : children_) out.push_back(ref);
  return out;
}

std::int32_t Children::rss_mb(const AttemptRef& ref) {
  const auto found = children_.find(ref);
  if (found == children_.end()) return 0;
  const int now_mb = tree_rss_mb(found->second.pid);
  found->second.peak_rss_mb = std::max(found->second.peak_rss_mb, now_mb);
  return now_mb;
}

std::vector<int> Children::exit_fds() const {
  std::vector<int> out;
  for (const auto& [ref, child] : children_) out.push_back(child.pid_fd);
  return out;
}

}  // namespace vantage
