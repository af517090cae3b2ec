#pragma once
/// What a farm's database and store say, and what must always be so.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tests/faults/short_farm.h"

namespace vantage::faults {

struct JobFact {
  std::int64_t id = 0;
  std::string name, kind, state, key, content, reason, error_kind, error;
  int num_attempts = 0, ram_mb = 0;
};
struct AttemptFact {
  std::string job, worker_id, state, outcome, error;
  int number = 0, signal = 0;
  std::int64_t leased_ms = 0;
};

std::vector<JobFact> jobs_of(const ShortFarm& farm);
/// In the order in which they were begun.
std::vector<AttemptFact> attempts_of(const ShortFarm& farm);
JobFact job_of(const ShortFarm& farm, const std::string& name);
/// How many jobs are in this state.
int num_jobs_in(const ShortFarm& farm, const std::string& state);
std::string shot_state(const ShortFarm& farm, std::int64_t shot);

/// Waits until the shot is done or failed; a failed expectation, with what the farm says, when the time is over.
/// Returns its state.
std::string wait_for_end(const ShortFarm& farm, std::int64_t shot, double timeout_s);
/// Waits until this attempt of the job runs; false when the time is over.
bool wait_for_running(const ShortFarm& farm, const std::string& job, int number, double timeout_s);

/// Expectations on a farm whose shot has ended well: every job has a valid artifact with the content that the database
/// believes, hashes checked; no job was done twice; no attempt is open; nothing was computed after its commit.
/// journal: what VANTAGE_SHORT_JOURNAL named; empty: not looked at.
void expect_all_done_once(const ShortFarm& farm, const std::filesystem::path& shot,
                          const std::filesystem::path& journal = {});
/// Content of every good job, by name.
std::map<std::string, std::string> contents_of(const ShortFarm& farm);

}  // namespace vantage::faults
