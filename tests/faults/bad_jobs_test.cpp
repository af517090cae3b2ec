/// Jobs that misbehave harm nobody but themselves, and people read why.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <fstream>

#include "tests/faults/farm_facts.h"
#include "tests/support/temporary_folder.h"

namespace vantage::faults {
namespace {
namespace fs = std::filesystem;
using testing::AllOf;
using testing::AnyOf;
using testing::ContainsRegex;
using testing::HasSubstr;

constexpr double kPatience_s = 60;

class BadJobs : public testing::Test {
 protected:
  BadJobs() : farm(folder.path()) { farm.start(); }
  fs::path shot() const { return folder.path() / "shot"; }
  std::int64_t submit(const std::string& tables) {
    write_short_shot(shot(), tables);
    return farm.submit(shot());
  }
  std::string why(const std::string& job) { return farm.ask({"why", shot(), job}); }
  int num_good(const std::string& kind) const {
    int num = 0;
    for (const JobFact& job : jobs_of(farm)) num += job.kind == kind && (job.state == "done") ? 1 : 0;
    return num;
  }

  TemporaryFolder folder;
  ShortFarm farm;
};

TEST_F(BadJobs, APoisonJobIsSetAsideAfterThreeCrashesAndNobodyElseIsBlamed) {
  ShortWorker first(farm, "first"), second(farm, "second");
  const auto id = submit("[seed]\nnum_jobs = 40\npause_ms = 20\n[trouble]\ncrash = 1\n");
  EXPECT_EQ(wait_for_end(farm, id, kPatience_s), "failed");
  const JobFact poison = job_of(farm, "trouble/crash-0");
  EXPECT_EQ(poison.state, "quarantined");
  EXPECT_EQ(poison.num_attempts, 3);
  EXPECT_EQ(num_good("seed"), 40);
  for (const JobFact& job : jobs_of(farm)) EXPECT_EQ(job.num_attempts, job.kind == "seed" ? 1 : 3) << job.name;
  EXPECT_THAT(why("trouble/crash-0"), AllOf(HasSubstr("quarantined"), HasSubstr("signal 6")));
}

TEST_F(BadJobs, HungJobsAreEndedWhenTheirTimeIsOver) {
  ShortWorker worker(farm, "worker", {.slots = 2});
  const auto id = submit("[seed]\nnum_jobs = 5\n[trouble]\nhang = 1\nbusy = 1\ntimeout_s = 1\n");
  EXPECT_EQ(wait_for_end(farm, id, kPatience_s), "failed");
  for (const char* job : {"trouble/hang-0", "trouble/busy-0"}) {
    EXPECT_EQ(job_of(farm, job).state, "failed");
    EXPECT_THAT(why(job), HasSubstr("ran longer than its limit of 1 s"));
  }
  EXPECT_EQ(num_good("seed"), 5);
  EXPECT_TRUE(wait_until([&] { return worker.children().empty(); }, 5));
}

/// The worker's memory is limited as a small machine's is; the job wants more each time.
TEST_F(BadJobs, AMemoryHogIsGivenMoreAndThenGivenUp) {
  const std::string small = "prlimit --as=900000000 " VANTAGE_BIN "/vantage-short-worker \"$@\"";
  const fs::path program = folder.path() / "small-worker";
  std::ofstream(program) << "#!/bin/sh\nexec " << small << "\n";
  fs::permissions(program, fs::perms::owner_all);
  ShortWorker worker(farm, "worker", {.slots = 1, .program = program});
  const auto id = submit("[seed]\nnum_jobs = 5\n[trouble]\nhog = 1\nhog_mb = 2000\nram_mb = 100\n");
  EXPECT_EQ(wait_for_end(farm, id, kPatience_s), "failed");
  const JobFact hog = job_of(farm, "trouble/hog-0");
  EXPECT_EQ(hog.state, "failed");
  EXPECT_EQ(hog.error_kind, "resource");
  EXPECT_GT(hog.num_attempts, 1);
  EXPECT_GT(hog.ram_mb, 100) << "it was tried with more";
  EXPECT_THAT(why("trouble/hog-0"), AnyOf(HasSubstr("out of memory"),
                                          ContainsRegex("used [1-9][0-9]* MB of memory; [0-9]+ MB were reserved")));
  EXPECT_EQ(num_good("seed"), 5);
}

TEST_F(BadJobs, AGigabyteOfLogFillsNoDiskAndCostsNoResult) {
  ShortWorker worker(farm, "worker", {.slots = 1});
  const auto id = submit("[seed]\nnum_jobs = 5\n[trouble]\nchatter = 1\nchatter_mb = 1024\n");
  EXPECT_EQ(wait_for_end(farm, id, kPatience_s), "done");
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(shot() / ".vantage/logs"))
    if (entry.is_regular_file()) bytes += entry.file_size();
  EXPECT_LT(bytes, 256U << 20U) << "logs are cut";
  const std::string log = farm.ask({"logs", shot(), "trouble/chatter-0"});
  EXPECT_FALSE(log.empty());
  expect_all_done_once(farm, shot());
}

TEST_F(BadJobs, APassingFailureIsTriedAgain) {
  ShortWorker worker(farm, "worker");
  const auto id =
      submit("[trouble]\nflaky = 1\nnum_failures = 2\nmemory_dir = \"" + folder.path().string() + "\"\nbad = 1\n");
  EXPECT_EQ(wait_for_end(farm, id, kPatience_s), "failed");
  EXPECT_EQ(job_of(farm, "trouble/flaky-0").state, "done");
  EXPECT_EQ(job_of(farm, "trouble/flaky-0").num_attempts, 3);
  EXPECT_EQ(job_of(farm, "trouble/bad-0").num_attempts, 1) << "bad input is bad tomorrow, too";
  EXPECT_THAT(why("trouble/bad-0"), HasSubstr("this input is bad"));
}

TEST_F(BadJobs, AWorkerWithoutAProgramLeavesItsJobsToOthers) {
  ShortWorker without(farm, "without");
  const auto id = submit("[seed]\nnum_jobs = 5\n[tool]\nnum_jobs = 3\n");
  ASSERT_TRUE(wait_until([&] { return num_good("seed") == 5; }, kPatience_s));
  EXPECT_THAT(without.printed(), HasSubstr("vantage-short-tool"));
  std::string seen;
  EXPECT_TRUE(wait_until(
      [&] {
        seen = why("tool/00000");
        return seen.find("vantage-short-tool") != std::string::npos || seen.find("no worker") != std::string::npos;
      },
      10))
      << "people read what it waits for: " << seen;
  EXPECT_EQ(job_of(farm, "tool/00000").num_attempts, 0);

  const fs::path tools = folder.path() / "tools";
  fs::create_directories(tools);
  fs::create_symlink("/bin/true", tools / "vantage-short-tool");
  ShortWorker with(farm, "with",
                   {.place = {.environment = {"PATH=" + tools.string() + ":/usr/bin:/bin:/usr/sbin:/sbin"}}});
  EXPECT_EQ(wait_for_end(farm, id, kPatience_s), "done");
  for (const AttemptFact& attempt : attempts_of(farm))
    EXPECT_TRUE(!attempt.job.starts_with("tool/") || attempt.worker_id == with.id()) << attempt.job;
  expect_all_done_once(farm, shot());
}

}  // namespace
}  // namespace vantage::faults
