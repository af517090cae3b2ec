#include "worker/fork_server.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <map>

#include "schema/base/error.h"

namespace vantage {
namespace {

/// Inherited by the children: the kernel takes them first when memory runs out.
void offer_to_the_oom_killer() {
  if (const int fd = open("/proc/self/oom_score_adj", O_WRONLY | O_CLOEXEC); fd >= 0) {
    [[maybe_unused]] const ssize_t written = write(fd, "500", 3);
    close(fd);
  }
}

int open_log(const std::string& path) {
  constexpr int kFlags = O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC;
  int fd = open(path.c_str(), kFlags, 0644);
  if (fd < 0 && errno == ENOENT) {
    std::error_code ignored;  // the second open() says it better
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
    fd = open(path.c_str(), kFlags, 0644);
  }
  if (fd < 0) throw Error(ErrorKind::Transient, fmt::format("{}: cannot open the log: {}", path, std::strerror(errno)));
  return fd;
}

class ForkServer {
 public:
  ForkServer(int socket, const ChildMain& child_main) : socket_(socket), child_main_(child_main) {
    fcntl(socket_, F_SETFD, FD_CLOEXEC);  // programs that a job runs have no use for it
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGCHLD);
    sigprocmask(SIG_SETMASK, &set, nullptr);
    signal_fd_ = signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
    check(signal_fd_ >= 0, "the process has file descriptors left");
    for (const int s : {SIGPIPE, SIGHUP, SIGINT, SIGTERM}) signal(s, SIG_DFL);
    offer_to_the_oom_killer();
  }

  int run() {
    while (!closed_) {
      pollfd fds[] = {{.fd = socket_, .events = POLLIN, .revents = 0},
                      {.fd = signal_fd_, .events = POLLIN, .revents = 0}};
      poll(fds, 2, -1);
      if (fds[0].revents != 0) take_packets();
      if (fds[1].revents != 0) reap();
    }
    for (const auto& [pid, ref] : refs_) kill(-pid, SIGKILL);
    return 0;
  }

 private:
  void take_packets() {
    for (;;) {
      const Received received = receive_packet(socket_);
      closed_ = received.closed;
      if (!received.packet) return;
      const Json& packet = *received.packet;
      if (packet.at("what") == "start")
        start(child_request_of(packet));
      else
        signal_group(attempt_ref_of(packet.at("ref")), packet.at("signal"));
    }
  }

  void start(const ChildRequest& request) {
    const pid_t server = getpid();
    const pid_t pid = fork();
    if (pid == 0) become_child(request, server);
    if (pid < 0) {
      const std::string why = fmt::format("cannot start a process: {}", std::strerror(errno));
      ChildLink(socket_, request.ref)
          .outcome({.ref = request.ref,
                    .outcome = Outcome::Failed,
                    .error_kind = "resource",
                    .message = why,
                    .content = {}});
      tell_end(request.ref, 0, 0, 0);
      return;
    }
    setpgid(pid, pid);  // here as well, or a signal to the group could come before the group is
    refs_[pid] = request.ref;
    send_packet(socket_, {{"what", "started"}, {"ref", to_json(request.ref)}, {"pid", pid}});
  }

  [[noreturn]] void become_child(const ChildRequest& request, pid_t server) {
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != server) _exit(1);  // it died before the line above
    close(signal_fd_);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    ChildLink link(socket_, request.ref);
    int status = 1;
    try {
      redirect_output(request.log_path);
      status = child_main_(request, link);
    } catch (const std::exception& e) {
      const auto* ours = dynamic_cast<const Error*>(&e);
      link.outcome({.ref = request.ref,
                    .outcome = Outcome::Failed,
                    .error_kind = std::string(to_string(ours != nullptr ? ours->kind() : ErrorKind::Bug)),
                    .message = one_line(e.what()),
                    .content = {}});
    }
    std::cout.flush();
    std::fflush(nullptr);
    _exit(status);  // the destructors of some hundred libraries have nothing to do here
  }

  static void redirect_output(const std::string& log_path) {
    if (log_path.empty()) return;
    const int fd = open_log(log_path);
    dup2(fd, STDOUT_FILENO);
    dup2(fd, STDERR_FILENO);
    close(fd);
  }

  /// Only to children that are not reaped yet, so that no other process can have their number.
  void signal_group(const AttemptRef& ref, int signal) {
    for (const auto& [pid, its_ref] : refs_)
      if (its_ref == ref) kill(-pid, signal);
  }

  void reap() {
    signalfd_siginfo info{};
    while (read(signal_fd_, &info, sizeof info) == sizeof info) continue;
    for (;;) {
      siginfo_t ended{};
      if (waitid(P_ALL, 0, &ended, WEXITED | WNOHANG | WNOWAIT) != 0 || ended.si_pid == 0) return;
      kill(-ended.si_pid, SIGKILL);  // grandchildren that outlived it would write into folders that are gone
      int status = 0;
      rusage usage{};
      wait4(ended.si_pid, &status, 0, &usage);
      const auto found = refs_.find(ended.si_pid);
      if (found == refs_.end()) continue;
      tell_end(found->second, ended.si_pid, status, usage.ru_maxrss / 1024);
      refs_.erase(found);
    }
  }

  void tell_end(const AttemptRef& ref, pid_t pid, int status, std::int64_t peak_rss_mb) {
    send_packet(socket_,
                {{"what", "ended"}, {"ref", to_json(ref)}, {"pid", pid}, {"status", status}, {"rss", peak_rss_mb}});
  }

  int socket_;
  const ChildMain& child_main_;
  int signal_fd_ = -1;
  bool closed_ = false;
  std::map<pid_t, AttemptRef> refs_;
};

}  // namespace

int run_fork_server(int socket, const ChildMain& child_main) { return ForkServer(socket, child_main).run(); }

}  // namespace vantage
