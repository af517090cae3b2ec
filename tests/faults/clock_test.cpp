/// Machines that disagree about the time by hours, and a clock that is set while the farm runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/faults/farm_facts.h"
#include "tests/support/temporary_folder.h"

namespace vantage::faults {
namespace {
namespace fs = std::filesystem;

/// libfaketime; empty when it is not installed.
std::string library() {
  for (const char* path : {"/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1",
                           "/usr/lib/aarch64-linux-gnu/faketime/libfaketimeMT.so.1"})
    if (fs::exists(path)) return path;
  return "";
}

class Clocks : public testing::Test {
 protected:
  void SetUp() override {
    if (library().empty()) GTEST_SKIP() << "libfaketime is not installed (package faketime)";
  }
  /// The wall clock alone lies; time that passes stays true, as it does on a real machine.
  std::vector<std::string> with_clock_of(const fs::path& file) const {
    return {"LD_PRELOAD=" + library(), "FAKETIME_TIMESTAMP_FILE=" + file.string(), "FAKETIME_NO_CACHE=1",
            "FAKETIME_DONT_FAKE_MONOTONIC=1"};
  }
  static void set_clock(const fs::path& file, const std::string& offset) { std::ofstream(file) << offset << "\n"; }
  fs::path clock(const std::string& name) const { return folder.path() / (name + ".clock"); }
  fs::path shot() const { return folder.path() / "shot"; }

  TemporaryFolder folder;
};

TEST_F(Clocks, HoursOfSkewAndAJumpChangeNothing) {
  set_clock(clock("farm"), "+0");
  set_clock(clock("ahead"), "+5h");
  set_clock(clock("behind"), "-7h");
  ShortFarm farm(folder.path(), {.place = {.environment = with_clock_of(clock("farm"))}});
  farm.start();
  ShortWorker ahead(farm, "ahead", {.slots = 1, .place = {.environment = with_clock_of(clock("ahead"))}});
  ShortWorker behind(farm, "behind", {.slots = 1, .place = {.environment = with_clock_of(clock("behind"))}});
  write_short_shot(shot(), "[seed]\nnum_jobs = 120\npause_ms = 60\n[trouble]\nslow = 2\nslow_ms = 4000\n");
  const auto id = farm.submit(shot());
  for (const char* offset : {"+9h", "-9h", "+0"}) {
    const int num_before = num_jobs_in(farm, "done");
    ASSERT_TRUE(wait_until([&] { return num_jobs_in(farm, "done") >= num_before + 10; }, 30)) << "before " << offset;
    set_clock(clock("farm"), offset);
    set_clock(clock("ahead"), offset);
  }
  EXPECT_EQ(wait_for_end(farm, id, 60), "done");
  expect_all_done_once(farm, shot());
  std::map<std::string, int> num_by_worker;
  for (const AttemptFact& attempt : attempts_of(farm)) {
    EXPECT_EQ(attempt.outcome, "done") << attempt.job << ": no lease was lost to a clock: " << attempt.error;
    ++num_by_worker[attempt.worker_id];
  }
  EXPECT_EQ(num_by_worker.size(), 2U) << "both took part";
}

/// A worker whose clock was set back since its last start is still known as the later life of itself.
TEST_F(Clocks, AWorkerRestartedWithAnEarlierClockIsHeard) {
  set_clock(clock("worker"), "+3h");
  ShortFarm farm(folder.path());
  farm.start();
  ShortWorker worker(farm, "worker", {.place = {.environment = with_clock_of(clock("worker"))}});
  write_short_shot(shot(), "[seed]\nnum_jobs = 40\npause_ms = 50\n");
  const auto id = farm.submit(shot());
  ASSERT_TRUE(wait_until([&] { return num_jobs_in(farm, "done") >= 5; }, 30));
  worker.kill();
  set_clock(clock("worker"), "-3h");
  worker.start();
  EXPECT_EQ(wait_for_end(farm, id, 60), "done");
  expect_all_done_once(farm, shot());
}

}  // namespace
}  // namespace vantage::faults
