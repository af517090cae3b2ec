#include "scheduler/dispatch/worker_table.h"

#include <algorithm>

namespace vantage {

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
