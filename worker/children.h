#pragma once
#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "schema/messages/protocol.h"

namespace vantage {

/// A program to run for an attempt.
struct ChildCommand {
  AttemptRef ref;
  std::vector<std::string> argv;   ///< argv[0] is the program's path
  std::filesystem::path log_path;  ///< stdout and stderr, appended
};

/// Child processes, each the leader of its own process group, killed with its worker, preferred by the kernel when
/// memory runs out. The thread that calls start() must live as long as the worker: a child is killed when its parent
/// thread ends.
class Children {
 public:
  struct Ended {
    AttemptRef ref;
    pid_t pid = 0;
    std::int32_t exit_code = 0, signal = 0;
    std::int64_t wall_ms = 0;
    std::int32_t peak_rss_mb = 0;
    bool out_of_memory = false;  ///< the kernel killed something for lack of memory while it ran
  };
  Children() = default;
  ~Children();  ///< kills and reaps what still runs
  Children(const Children&) = delete;
  Children& operator=(const Children&) = delete;

  /// Throws Error(Resource) when the machine has no process left, Error(Transient) when the log file or the program
  /// cannot be opened.
  void start(const ChildCommand& command);
  /// To the whole process group.
  void signal_group(const AttemptRef& ref, int signal);
  /// Children that have ended since the last call; what is left of their groups is killed.
  std::vector<Ended> reap();
  std::vector<AttemptRef> running() const;
  /// Memory of a child and its descendants.
  std::int32_t rss_mb(const AttemptRef& ref);
  /// Readable when a child has ended: one descriptor per child, for poll().
  std::vector<int> exit_fds() const;

 private:
  struct Child {
    pid_t pid = 0;
    int pid_fd = -1;
    std::chrono::steady_clock::time_point start;
    std::int32_t peak_rss_mb = 0;
    std::int64_t oom_kills_before = 0;
  };
  Ended ended(const AttemptRef& ref, const Child& child, int status, std::int32_t max_rss_mb) const;
  std::map<AttemptRef, Child> children_;
};

}  // namespace vantage
