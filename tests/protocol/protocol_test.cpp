/// Thousands of random schedules of faults, each against the real dispatcher and the real agents in simulated time.
///
///   VANTAGE_SCHEDULES=20000 protocol_test      more of them
///   VANTAGE_FIRST_SEED=4711 VANTAGE_SCHEDULES=1 protocol_test     one again
#include <gtest/gtest.h>
#include <stdlib.h>

#include <string>

#include "tests/protocol/simulation.h"

namespace vantage {
namespace {

std::uint64_t from_environment(const char* name, std::uint64_t fallback) {
  const char* text = getenv(name);
  return text == nullptr ? fallback : std::stoull(text);
}

/// Every schedule has a database of its own; on a disk that would be most of the time.
void use_memory_for_temporary_files() {
  if (getenv("TMPDIR") == nullptr && access("/dev/shm", W_OK) == 0) setenv("TMPDIR", "/dev/shm", 1);
}

std::string story_of(const Schedule& failing) {
  const Schedule small = shrink(failing);
  const RunResult result = run_schedule(small);
  std::string text = fmt::format("again with VANTAGE_FIRST_SEED={} VANTAGE_SCHEDULES=1; as small as it gets:\n{}",
                                 failing.seed, to_text(small));
  for (const std::string& line : result.trace) text += line + "\n";
  return text;
}

TEST(Protocol, KeepsItsPromisesUnderAnyScheduleOfFaults) {
  use_memory_for_temporary_files();
  const std::uint64_t first = from_environment("VANTAGE_FIRST_SEED", 1);
  const std::uint64_t num = from_environment("VANTAGE_SCHEDULES", 2'000);
  std::int64_t num_killed = 0, num_attempts = 0, num_dropped = 0, simulated_ms = 0;
  for (std::uint64_t seed = first; seed < first + num; ++seed) {
    const Schedule schedule = random_schedule(seed);
    const RunResult result = run_schedule(schedule);
    ASSERT_EQ(result.violation, "") << story_of(schedule);
    num_killed += result.num_killed;
    num_attempts += result.num_attempts;
    num_dropped += result.num_dropped;
    simulated_ms += result.simulated_ms;
  }
  fmt::print(
      "{} schedules, {} h of simulated time: scheduler killed {} times, {} attempts ended, {} datagrams dropped\n", num,
      simulated_ms / 3'600'000, num_killed, num_attempts, num_dropped);
}

TEST(Protocol, ASeedIsASchedule) {
  use_memory_for_temporary_files();
  const RunResult once = run_schedule(random_schedule(7)), again = run_schedule(random_schedule(7));
  EXPECT_EQ(once.trace, again.trace);
  EXPECT_GT(once.trace.size(), 15U);
}

}  // namespace
}  // namespace vantage
