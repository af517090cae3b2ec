#include "worker/machine.h"

#include <fmt/format.h>
#include <limits.h>
#include <sched.h>
#include <sys/sysinfo.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>
#include <vector>

namespace vantage {
namespace {

constexpr std::int64_t kMiB = 1 << 20;

/// A number alone in a file of the kernel's; fallback when there is none ("max" means no limit).
std::int64_t number_in(const char* path, std::int64_t fallback) {
  std::ifstream in(path);
  std::int64_t value = 0;
  return in >> value ? value : fallback;
}

std::vector<pid_t> children_of(pid_t pid) {
  std::ifstream in(fmt::format("/proc/{0}/task/{0}/children", pid));
  std::vector<pid_t> out;
  for (pid_t child = 0; in >> child;) out.push_back(child);
  return out;
}

struct ProcessUsage {
  std::int64_t rss_pages = 0, cpu_ticks = 0;
};

ProcessUsage usage_of(pid_t pid) {
  std::ifstream in(fmt::format("/proc/{}/stat", pid));
  std::string line;
  std::getline(in, line);
  const std::size_t name_end = line.rfind(')');
  if (name_end == std::string::npos) return {};
  std::istringstream fields(line.substr(name_end + 1));
  std::string skipped;
  for (int i = 3; i < 14; ++i) fields >> skipped;  // proc(5) counts from 1; the name is the second
  ProcessUsage out;
  for (int i = 14; i <= 17; ++i) {  // utime, stime, cutime, cstime
    std::int64_t ticks = 0;
    fields >> ticks;
    out.cpu_ticks += ticks;
  }
  for (int i = 18; i < 24; ++i) fields >> skipped;
  fields >> out.rss_pages;
  return out;
}

}  // namespace

std::string host_name() {
  std::array<char, HOST_NAME_MAX + 1> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown-host";
}

int num_usable_cores() {
  cpu_set_t set;
  return sched_getaffinity(0, sizeof set, &set) == 0 ? std::max(1, CPU_COUNT(&set)) : 1;
}

int total_ram_mb() {
  struct sysinfo info {};
  sysinfo(&info);
  std::int64_t bytes = static_cast<std::int64_t>(info.totalram) * info.mem_unit;
  for (const char* limit : {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"})
    bytes = std::min(bytes, number_in(limit, bytes));
  return static_cast<int>(bytes / kMiB);
}

int available_ram_mb() {
  std::ifstream in("/proc/meminfo");
  std::string name, unit;
  for (std::int64_t kib = 0; in >> name >> kib >> unit;)
    if (name == "MemAvailable:") return static_cast<int>(kib / 1024);
  return total_ram_mb();
}

TreeUsage tree_usage(pid_t root) {
  std::vector<pid_t> todo{root};
  ProcessUsage sum;
  for (std::size_t i = 0; i < todo.size(); ++i) {
    const ProcessUsage one = usage_of(todo[i]);
    sum.rss_pages += one.rss_pages;
    sum.cpu_ticks += one.cpu_ticks;
    const auto children = children_of(todo[i]);
    todo.insert(todo.end(), children.begin(), children.end());
  }
  return {static_cast<std::int32_t>(sum.rss_pages * sysconf(_SC_PAGESIZE) / kMiB), sum.cpu_ticks};
}

std::int64_t num_oom_kills() {
  std::ifstream in("/proc/vmstat");
  std::string name;
  for (std::int64_t value = 0; in >> name >> value;)
    if (name == "oom_kill") return value;
  return 0;
}

}  // namespace vantage
