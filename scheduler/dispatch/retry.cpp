#include "scheduler/dispatch/retry.h"

#include <fmt/format.h>

#include <algorithm>

#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr int kMaxTransientTries = 5, kMaxResourceTries = 3, kMaxCrashes = 3;

std::int64_t back_off_ms(int num_failures, double jitter) {
  const double base_ms = 1000.0 * static_cast<double>(1 << std::min(num_failures - 1, 6));
  return static_cast<std::int64_t>(base_ms * (0.8 + 0.4 * jitter));
}

RetryDecision after_crash(RetryDecision d, const DoneAttempt& attempt) {
  ++d.num_crashes;
  if (d.num_crashes >= kMaxCrashes) {
    d.to = JobState::Quarantined;
    d.reason = fmt::format("crashed {} times: {}", d.num_crashes, attempt.message);
  } else {
    d.to = JobState::Ready;
    d.reason = fmt::format("crashed, runs alone next: {}", attempt.message);
  }
  return d;
}

RetryDecision after_failure(RetryDecision d, const DoneAttempt& attempt, int max_tries) {
  ++d.num_failures;
  if (d.num_failures >= max_tries) {
    d.reason = fmt::format("failed {} times: {}", d.num_failures, attempt.message);
  } else {
    d.to = JobState::Ready;
    d.reason = fmt::format("try {} of {} after: {}", d.num_failures + 1, max_tries, attempt.message);
  }
  return d;
}

}  // namespace

RetryDecision without_blame(const JobRow& job, const std::string& reason) {
  return {.to = JobState::Ready,
          .reason = reason,
          .num_failures = job.num_failures,
          .num_crashes = job.num_crashes,
          .delay_ms = 0,
          .ram_mb = job.ram_mb,
          .timeout_s = job.timeout_s};
}

RetryDecision decide_retry(const JobRow& job, const DoneAttempt& attempt, double jitter) {
  RetryDecision d{.to = JobState::Failed,
                  .reason = attempt.message,
                  .num_failures = job.num_failures,
                  .num_crashes = job.num_crashes,
                  .delay_ms = 0,
                  .ram_mb = job.ram_mb,
                  .timeout_s = job.timeout_s};
  if (attempt.outcome == Outcome::Canceled) return without_blame(job, "given back by its worker");
  if (attempt.outcome == Outcome::Crashed) return after_crash(d, attempt);
  switch (error_kind_from(attempt.error_kind)) {
    case ErrorKind::Crash:
      return after_crash(d, attempt);
    case ErrorKind::Transient:
      d = after_failure(d, attempt, kMaxTransientTries);
      d.delay_ms = back_off_ms(d.num_failures, jitter);
      return d;
    case ErrorKind::Resource:
      d.ram_mb += d.ram_mb / 2;
      d.timeout_s += d.timeout_s / 2;
      return after_failure(d, attempt, kMaxResourceTries);
    case ErrorKind::BadInput:
    case ErrorKind::Bug:
      return d;
  }
  return d;
}

}  // namespace vantage
