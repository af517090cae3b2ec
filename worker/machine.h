#pragma once
#include <sys/types.h>

#include <cstdint>
#include <string>

namespace vantage {

std::string host_name();
/// Cores this process may use (its CPU affinity), at least 1.
int num_usable_cores();
/// Memory of the machine, or of the container when that is less.
int total_ram_mb();
/// Memory that can be had without swapping.
int available_ram_mb();
/// Of a process and all its descendants; nothing when it has ended.
struct TreeUsage {
  std::int32_t rss_mb = 0;
  std::int64_t cpu_ticks = 0;  ///< processor time used so far, descendants that have ended and were waited for included
};
TreeUsage tree_usage(pid_t root);
/// How often the kernel killed something for lack of memory since boot; 0 when it does not say.
std::int64_t num_oom_kills();

}  // namespace vantage
