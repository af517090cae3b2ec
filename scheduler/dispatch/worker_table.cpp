#include "scheduler/dispatch/worker_table.h"

#include <algorithm>

namespace vantage {

std::string_view LiveWorker::state() const {
  if (lost) return "lost";
  if (drained || report.draining) return "draining";
  if (!set_aside.empty()) return "set aside";
  if (!report.trouble.empty()) return "in trouble";
  return outside_hours ? "off hours" : "active";
}

bool LiveWorker::offers(std::string_view kind, std::optional<int> version) const {
  if (report.kinds.empty()) return kind != "selftest";
  return std::any_of(report.kinds.begin(), report.kinds.end(), [&](const std::string& offered) {
    if (!offered.starts_with(kind) || offered.size() <= kind.size() || offered[kind.size()] != '/') return false;
    return !version || offered.substr(kind.size() + 1) == std::to_string(*version);
  });
}

bool LiveWorker::serves(const Wanted& wanted) const {
  if (!wanted.pool.empty() && wanted.pool != report.pool) return false;
  for (std::size_t begin = 0; begin < wanted.tags.size();) {
    const std::size_t end = std::min(wanted.tags.find(' ', begin), wanted.tags.size());
    const std::string_view tag = wanted.tags.substr(begin, end - begin);
    if (std::find(report.tags.begin(), report.tags.end(), tag) == report.tags.end()) return false;
    begin = end + 1;
  }
  return offers(wanted.kind, wanted.version);
}

int LiveWorker::used_cores() const {
  int sum = 0;
  for (const auto& [ref, held_attempt] : held) sum += std::min(held_attempt.assignment.cores, report.cores);
  return sum;
}

int LiveWorker::used_ram_mb() const {
  int sum = 0;
  for (const auto& [ref, held_attempt] : held) sum += std::min(held_attempt.assignment.ram_mb, report.ram_mb);
  return sum;
}

bool LiveWorker::runs_something_alone() const {
  return std::any_of(held.begin(), held.end(), [](const auto& entry) { return entry.second.alone; });
}

}  // namespace vantage
