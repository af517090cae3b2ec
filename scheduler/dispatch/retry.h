#pragma once
#include <cstdint>
#include <string>

#include "scheduler/store/rows.h"

namespace vantage {

/// What becomes of a job whose attempt failed.
struct RetryDecision {
  JobState to = JobState::Failed;  ///< Ready, Failed or Quarantined
  std::string reason;
  int num_failures = 0, num_crashes = 0;
  std::int64_t delay_ms = 0;  ///< before the next try
  int ram_mb = 0, timeout_s = 0;
};

/// Transient: again after 1, 2, 4, … s, five tries. Resource: at once with half as much again, three tries. Crash:
/// again, alone on a worker; after the third, quarantine. Bad input and bugs: failed. Canceled by the worker: again, no
/// blame. jitter: in [0, 1), spreads the delays by ±20 % so that many jobs do not come back at once.
RetryDecision decide_retry(const JobRow& job, const DoneAttempt& attempt, double jitter);

/// Again, as if it had not been tried.
RetryDecision without_blame(const JobRow& job, const std::string& reason);

}  // namespace vantage
