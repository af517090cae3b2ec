#pragma once
#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "worker/child_link.h"
#include "worker/machine.h"

namespace vantage {

/// A worker's side of its fork server (fork_server.h), which it starts, and starts again should it die. The thread that
/// makes it must live as long as the worker: the server, and all children with it, are killed when that thread ends.
class Children {
 public:
  /// Turns the process that was just forked into a fork server on that socket; does not return. System calls only: the
  /// worker has threads.
  using Become = std::function<void(int socket)>;

  struct Ended {
    AttemptRef ref;
    pid_t pid = 0;
    std::int32_t exit_code = 0, signal = 0;
    std::int64_t wall_ms = 0;
    std::int32_t peak_rss_mb = 0;
    bool out_of_memory = false;  ///< the kernel killed something for lack of memory while it ran
    bool has_outcome = false;    ///< the child told one
    DoneAttempt outcome;
  };
  struct Progress {
    double fraction = 0;
    std::string phase = "running";
  };
  struct News {
    std::vector<Ended> ended;
    std::vector<AttemptRef> lost;  ///< the fork server died, and they with it
  };

  explicit Children(Become become);
  ~Children();  ///< kills what still runs
  Children(const Children&) = delete;
  Children& operator=(const Children&) = delete;

  /// Throws Error(Transient) when the fork server cannot be reached.
  void start(const ChildRequest& request);
  /// To the whole process group.
  void signal_group(const AttemptRef& ref, int signal);
  /// What happened since the last call.
  News take();
  std::vector<AttemptRef> running() const;
  Progress progress(const AttemptRef& ref) const;
  /// Of a child and its descendants, now.
  TreeUsage usage(const AttemptRef& ref);
  /// Readable when there is news: for poll().
  int fd() const { return socket_; }

 private:
  struct Child {
    pid_t pid = 0;  ///< 0: not forked yet
    std::chrono::steady_clock::time_point start;
    std::int32_t peak_rss_mb = 0;
    std::int64_t oom_kills_before = 0;
    Progress progress;
    bool has_outcome = false;
    DoneAttempt outcome;
  };
  void start_server();
  void stop_server();
  void take_packet(const Json& packet, News& news);
  Ended ended(const AttemptRef& ref, const Child& child, const Json& packet);

  Become become_;
  pid_t server_ = -1;
  int socket_ = -1;
  std::int64_t oom_kills_seen_ = 0;
  std::map<AttemptRef, Child> children_;
};

/// Runs `program fork-server`, for Children.
Children::Become exec_fork_server(const std::string& program);

}  // namespace vantage
