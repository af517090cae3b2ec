#include "worker/children.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "schema/base/error.h"
#include "worker/fork_server.h"

namespace vantage {

Children::Children(Become become) : become_(std::move(become)), oom_kills_seen_(num_oom_kills()) { start_server(); }

Children::~Children() { stop_server(); }

void Children::start_server() {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0)
    throw Error(ErrorKind::Resource, fmt::format("cannot make a socket: {}", std::strerror(errno)));
  const pid_t worker = getpid();
  server_ = fork();
  if (server_ == 0) {
    setpgid(0, 0);  // signals from a terminal are for the worker
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != worker) _exit(1);
    const int null_fd = open("/dev/null", O_RDONLY);
    dup2(null_fd, STDIN_FILENO);
    dup2(ends[1], kForkServerSocket);
    close_range(kForkServerSocket + 1, ~0U, 0);  // LCM's sockets would keep the bus open after the worker's death
    fcntl(kForkServerSocket, F_SETFD, 0);
    become_(kForkServerSocket);
    _exit(1);
  }
  const int why = errno;
  close(ends[1]);
  socket_ = ends[0];
  if (server_ < 0) throw Error(ErrorKind::Resource, fmt::format("cannot start a process: {}", std::strerror(why)));
}

void Children::stop_server() {
  for (const auto& [ref, child] : children_)
    if (child.pid > 0) kill(-child.pid, SIGKILL);
  kill(server_, SIGKILL);
  waitpid(server_, nullptr, 0);
  close(socket_);
}

void Children::start(const ChildRequest& request) {
  check(!children_.contains(request.ref), "an attempt has one child");
  if (!send_packet(socket_, to_json(request)))
    throw Error(ErrorKind::Transient, fmt::format("cannot reach the fork server: {}", std::strerror(errno)));
  Child& child = children_[request.ref];
  child.start = std::chrono::steady_clock::now();
  child.oom_kills_before = oom_kills_seen_;
}

void Children::signal_group(const AttemptRef& ref, int signal) {
  if (children_.contains(ref)) send_packet(socket_, {{"what", "signal"}, {"ref", to_json(ref)}, {"signal", signal}});
}

Children::News Children::take() {
  News news;
  for (;;) {
    const Received received = receive_packet(socket_);
    if (received.packet) {
      take_packet(*received.packet, news);
      continue;
    }
    if (!received.closed) return news;
    for (const auto& [ref, child] : children_) news.lost.push_back(ref);
    stop_server();
    children_.clear();
    start_server();
    return news;
  }
}

void Children::take_packet(const Json& packet, News& news) {
  const auto found = children_.find(attempt_ref_of(packet.at("ref")));
  if (found == children_.end()) return;
  auto& [ref, child] = *found;
  const std::string what = packet.at("what");
  if (what == "started") {
    child.pid = packet.at("pid");
  } else if (what == "progress") {
    child.progress = {packet.at("fraction"), packet.at("phase")};
  } else if (what == "outcome") {
    child.has_outcome = true;
    child.outcome.outcome = packet.at("done").get<bool>() ? Outcome::Done : Outcome::Failed;
    child.outcome.error_kind = packet.at("error_kind");
    child.outcome.message = packet.at("message");
    child.outcome.content = packet.at("content");
    child.outcome.damaged_job = packet.at("damaged_job");
  } else {
    news.ended.push_back(ended(ref, child, packet));
    children_.erase(found);
  }
}

Children::Ended Children::ended(const AttemptRef& ref, const Child& child, const Json& packet) {
  const int status = packet.at("status");
  Ended e{.ref = ref, .pid = packet.at("pid"), .has_outcome = child.has_outcome, .outcome = child.outcome};
  if (WIFSIGNALED(status))
    e.signal = WTERMSIG(status);
  else
    e.exit_code = WEXITSTATUS(status);
  const auto wall = std::chrono::steady_clock::now() - child.start;
  e.wall_ms = std::chrono::duration_cast<std::chrono::milliseconds>(wall).count();
  e.peak_rss_mb = std::max(child.peak_rss_mb, packet.at("rss").get<std::int32_t>());
  if (e.signal == SIGKILL) {
    oom_kills_seen_ = num_oom_kills();
    e.out_of_memory = oom_kills_seen_ > child.oom_kills_before;
  }
  return e;
}

std::vector<AttemptRef> Children::running() const {
  std::vector<AttemptRef> out;
  for (const auto& [ref, child] : children_) out.push_back(ref);
  return out;
}

Children::Progress Children::progress(const AttemptRef& ref) const {
  const auto found = children_.find(ref);
  return found == children_.end() ? Progress{} : found->second.progress;
}

TreeUsage Children::usage(const AttemptRef& ref) {
  const auto found = children_.find(ref);
  if (found == children_.end() || found->second.pid == 0) return {};
  oom_kills_seen_ = num_oom_kills();
  const TreeUsage now = tree_usage(found->second.pid);
  found->second.peak_rss_mb = std::max(found->second.peak_rss_mb, now.rss_mb);
  return now;
}

Children::Become exec_fork_server(const std::string& program) {
  return [program](int) {
    char word[] = "fork-server";
    char* const argv[] = {const_cast<char*>(program.c_str()), word, nullptr};
    execv(argv[0], argv);
  };
}

}  // namespace vantage
