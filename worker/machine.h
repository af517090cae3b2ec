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
/// Resident memory of a process and all its descendants; 0 when it has ended.
int tree_rss_mb(pid_t root);
/// How often the kernel killed something for lack of memory since boot; 0 when it does not say.
std::int64_t num_oom_kills();

}  // namespace vantage
