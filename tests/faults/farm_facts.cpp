#include "tests/faults/farm_facts.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>

#include "scheduler/store/job_state.h"
#include "scheduler/store/sqlite.h"
#include "schema/base/error.h"
#include "schema/formats/manifest.h"

namespace vantage::faults {
namespace fs = std::filesystem;

std::vector<JobFact> jobs_of(const ShortFarm& farm) {
  Sqlite db = open_farm_to_read(farm.state());
  std::vector<JobFact> jobs;
  for (Query q = db.query("SELECT job.id, name, kind, state, key, content, reason, error_kind, error, num_attempts, "
                          "ram_mb FROM job ORDER BY job.id");
       q.step();)
    jobs.push_back({.id = q.integer(0),
                    .name = q.text(1),
                    .kind = q.text(2),
                    .state = q.text(3),
                    .key = q.text(4),
                    .content = q.text(5),
                    .reason = q.text(6),
                    .error_kind = q.text(7),
                    .error = q.text(8),
                    .num_attempts = static_cast<int>(q.integer(9)),
                    .ram_mb = static_cast<int>(q.integer(10))});
  return jobs;
}

std::vector<AttemptFact> attempts_of(const ShortFarm& farm) {
  Sqlite db = open_farm_to_read(farm.state());
  std::vector<AttemptFact> attempts;
  for (Query q = db.query("SELECT name, worker_id, attempt.state, outcome, attempt.error, number, signal, leased_ms "
                          "FROM attempt JOIN job ON job.id = job_id ORDER BY attempt.id");
       q.step();)
    attempts.push_back({.job = q.text(0),
                        .worker_id = q.text(1),
                        .state = q.text(2),
                        .outcome = q.text(3),
                        .error = q.text(4),
                        .number = static_cast<int>(q.integer(5)),
                        .signal = static_cast<int>(q.integer(6)),
                        .leased_ms = q.integer(7)});
  return attempts;
}

JobFact job_of(const ShortFarm& farm, const std::string& name) {
  for (JobFact& job : jobs_of(farm))
    if (job.name == name) return std::move(job);
  throw Error(ErrorKind::BadInput, "there is no job " + name);
}

int num_jobs_in(const ShortFarm& farm, const std::string& state) {
  Sqlite db = open_farm_to_read(farm.state());
  return static_cast<int>(db.integer_or(0, "SELECT count(*) FROM job WHERE state = ?", state));
}

std::string shot_state(const ShortFarm& farm, std::int64_t shot) {
  return open_farm_to_read(farm.state()).text_or("", "SELECT state FROM shot WHERE id = ?", shot);
}

std::string wait_for_end(const ShortFarm& farm, std::int64_t shot, double timeout_s) {
  std::string state;
  const bool ended = wait_until(
      [&] {
        state = shot_state(farm, shot);
        return state == "done" || state == "failed";
      },
      timeout_s);
  if (ended) return state;
  std::map<std::string, int> num_by_state;
  for (const JobFact& job : jobs_of(farm)) ++num_by_state[job.state];
  ADD_FAILURE() << "the shot did not end in " << timeout_s
                << " s; jobs by state: " << testing::PrintToString(num_by_state)
                << "\nthe scheduler printed: " << farm.printed();
  return state;
}

bool wait_for_running(const ShortFarm& farm, const std::string& job, int number, double timeout_s) {
  constexpr const char* kSql =
      "SELECT count(*) FROM attempt JOIN job ON job.id = job_id WHERE name = ? AND number = ? AND attempt.state = "
      "'running'";
  return wait_until([&] { return open_farm_to_read(farm.state()).integer_or(0, kSql, job, number) > 0; }, timeout_s);
}

namespace {

struct JournalLine {
  std::string job;
  std::int64_t at_ms = 0;
};

std::vector<JournalLine> read_journal(const fs::path& file) {
  std::vector<JournalLine> lines;
  std::ifstream in(file);
  for (JournalLine line; in >> line.job >> line.at_ms;) lines.push_back(line);
  return lines;
}

/// Moment of the rename that was the commit.
std::int64_t committed_ms(const fs::path& artifact) {
  struct stat info {};
  return stat(artifact.c_str(), &info) == 0 ? info.st_ctim.tv_sec * 1000 + info.st_ctim.tv_nsec / 1'000'000 : 0;
}

/// Kinds that write into the journal.
bool is_in_journal(const std::string& kind) { return kind == "seed" || kind == "mix" || kind == "join"; }

void expect_nothing_computed_after_its_commit(const std::map<std::string, std::int64_t>& committed_ms_by_job,
                                              const fs::path& journal) {
  std::map<std::string, int> num_runs;
  for (const auto& [job, at_ms] : read_journal(journal)) {
    ++num_runs[job];
    const auto committed = committed_ms_by_job.find(job);
    ASSERT_NE(committed, committed_ms_by_job.end()) << job;
    EXPECT_LE(at_ms, committed->second) << job << " was computed again after its result was committed";
  }
  EXPECT_EQ(num_runs.size(), committed_ms_by_job.size()) << "every job was computed";
}

}  // namespace

void expect_all_done_once(const ShortFarm& farm, const fs::path& shot, const fs::path& journal) {
  std::map<std::string, std::int64_t> committed;
  const std::vector<JobFact> jobs = jobs_of(farm);
  EXPECT_FALSE(jobs.empty());
  for (const JobFact& job : jobs) {
    EXPECT_TRUE(is_good(job_state_from(job.state).value())) << job.name << " is " << job.state << ": " << job.error;
    if (job.kind == "blip") continue;  // leaves nothing behind
    const fs::path artifact = artifact_folder(shot / ".vantage/store", job.kind, job.key);
    const auto manifest = read_valid_manifest(artifact, /*check_hashes=*/true);
    ASSERT_TRUE(manifest.has_value()) << job.name << " has no valid artifact";
    EXPECT_EQ(manifest->content, job.content) << job.name;
    if (is_in_journal(job.kind)) committed[job.name] = committed_ms(artifact);
  }
  std::map<std::string, int> num_done;
  for (const AttemptFact& attempt : attempts_of(farm)) {
    EXPECT_EQ(attempt.state, "ended") << attempt.job << " attempt " << attempt.number;
    num_done[attempt.job] += attempt.outcome == "done" ? 1 : 0;
    EXPECT_LE(num_done[attempt.job], 1) << attempt.job << " was done twice";
  }
  if (!journal.empty()) expect_nothing_computed_after_its_commit(committed, journal);
}

std::map<std::string, std::string> contents_of(const ShortFarm& farm) {
  std::map<std::string, std::string> contents;
  for (const JobFact& job : jobs_of(farm)) contents[job.name] = job.content;
  return contents;
}

}  // namespace vantage::faults
