/// Storage that is full, read-only, late or wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mount.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "schema/base/files.h"
#include "schema/formats/manifest.h"
#include "tests/faults/farm_facts.h"
#include "tests/support/temporary_folder.h"

namespace vantage::faults {
namespace {
namespace fs = std::filesystem;
using testing::AnyOf;
using testing::HasSubstr;

constexpr double kPatience_s = 40;

/// A small file system of its own.
class SmallDisk {
 public:
  SmallDisk(fs::path folder, const std::string& size) : folder_(std::move(folder)) {
    fs::create_directories(folder_);
    if (mount("vantage-test", folder_.c_str(), "tmpfs", 0, ("size=" + size).c_str()) != 0) why_not_ = strerror(errno);
  }
  ~SmallDisk() {
    if (why_not_.empty()) umount2(folder_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  /// Empty when it is there.
  const std::string& why_not() const { return why_not_; }
  bool set_read_only(bool on) {
    return mount("vantage-test", folder_.c_str(), "tmpfs", on ? MS_REMOUNT | MS_RDONLY : MS_REMOUNT, nullptr) == 0;
  }
  /// Takes all room but so much.
  void fill(std::uintmax_t but_bytes) {
    const std::uintmax_t available = fs::space(folder_).available;
    if (available > but_bytes) std::ofstream(folder_ / "ballast") << std::string(available - but_bytes, 'b');
  }
  void free() { fs::remove(folder_ / "ballast"); }

 private:
  fs::path folder_;
  std::string why_not_;
};

class StoreTest : public testing::Test {
 protected:
  StoreTest() : farm(folder.path()) { farm.start(); }
  fs::path shot() const { return folder.path() / "disk/shot"; }
  std::int64_t submit(const std::string& tables) {
    write_short_shot(shot(), tables);
    return farm.submit(shot());
  }
  fs::path artifact_of(const std::string& job) const {
    const JobFact fact = job_of(farm, job);
    return artifact_folder(shot() / ".vantage/store", fact.kind, fact.key);
  }
  /// All that people may ask about a job and the workers.
  std::string what_people_see(const std::string& job) {
    return farm.ask({"why", shot(), job}) + farm.ask({"workers"}) + farm.ask({"status", shot()});
  }

  TemporaryFolder folder;
  ShortFarm farm;
};

TEST_F(StoreTest, AFullDiskStopsNobodyForGood) {
  SmallDisk disk(folder.path() / "disk", "260m");
  if (!disk.why_not().empty()) GTEST_SKIP() << "a tmpfs cannot be mounted here: " << disk.why_not();
  ShortWorker worker(farm, "worker");
  const auto id = submit("[seed]\nnum_jobs = 30\nnum_bytes = 1000000\npause_ms = 100\n");
  ASSERT_TRUE(wait_until([&] { return num_jobs_in(farm, "done") >= 2; }, kPatience_s));
  disk.fill(/*but_bytes=*/100'000);
  std::string seen;
  EXPECT_TRUE(wait_until(
      [&] {
        seen = what_people_see("seed/00029");
        return seen.find("disk") != std::string::npos;
      },
      15))
      << "people are told that the disk is full: " << seen;
  usleep(3'000'000);
  EXPECT_FALSE(farm.scheduler().ended()) << farm.printed();
  EXPECT_EQ(shot_state(farm, id), "running") << "a full disk is no reason to give up: " << seen;
  disk.free();
  EXPECT_EQ(wait_for_end(farm, id, 90), "done");
  expect_all_done_once(farm, shot());
}

TEST_F(StoreTest, AReadOnlyStoreIsWaitedFor) {
  SmallDisk disk(folder.path() / "disk", "300m");
  if (!disk.why_not().empty()) GTEST_SKIP() << "a tmpfs cannot be mounted here: " << disk.why_not();
  ShortWorker worker(farm, "worker", {.slots = 1});
  const auto id = submit("[seed]\nnum_jobs = 20\npause_ms = 100\n");
  ASSERT_TRUE(wait_until([&] { return num_jobs_in(farm, "done") >= 3; }, kPatience_s));
  // Writers that are under way make the kernel refuse for a moment.
  ASSERT_TRUE(wait_until([&] { return disk.set_read_only(true); }, 5)) << strerror(errno);
  std::string seen;
  EXPECT_TRUE(wait_until(
      [&] {
        seen = farm.ask({"jobs", shot()}) + farm.ask({"workers"}) + farm.ask({"status", shot()});
        return seen.find("Read-only") != std::string::npos || seen.find("read-only") != std::string::npos;
      },
      10))
      << "people are told: " << seen;
  EXPECT_FALSE(farm.scheduler().ended()) << farm.printed();
  ASSERT_TRUE(disk.set_read_only(false));
  EXPECT_EQ(wait_for_end(farm, id, 60), "done");
  expect_all_done_once(farm, shot());
}

/// Network storage shows a folder to other machines when it pleases.
TEST_F(StoreTest, AResultThatIsSeenLateCounts) {
  ShortWorker worker(farm, "worker", {.slots = 1});
  const auto id = submit("[trouble]\nslow = 1\nslow_ms = 1000\n");
  ASSERT_TRUE(wait_for_running(farm, "trouble/slow-0", 1, kPatience_s));
  const fs::path artifact = artifact_of("trouble/slow-0"), away = folder.path() / "away";
  kill(farm.pid(), SIGSTOP);
  ASSERT_TRUE(wait_until([&] { return fs::exists(artifact); }, kPatience_s));
  fs::rename(artifact, away);
  kill(farm.pid(), SIGCONT);
  usleep(2'500'000);
  EXPECT_EQ(job_of(farm, "trouble/slow-0").state, "running") << "not believed, but not given up either";
  fs::rename(away, artifact);
  EXPECT_EQ(wait_for_end(farm, id, kPatience_s), "done");
  EXPECT_EQ(job_of(farm, "trouble/slow-0").num_attempts, 1);
  expect_all_done_once(farm, shot());
}

void flip_a_bit(const fs::path& file) {
  std::string bytes = read_file(file);
  bytes[bytes.size() / 2] ^= 1;
  write_file_atomically(file, bytes);
}

TEST_F(StoreTest, DamagedResultsAreMadeAgainBeforeTheyAreServed) {
  ShortWorker worker(farm, "worker");
  const std::string tables = "[seed]\nnum_jobs = 4\n[mix]\nnum_jobs = 4\n";
  ASSERT_EQ(wait_for_end(farm, submit(tables), kPatience_s), "done");
  const auto whole = contents_of(farm);
  fs::resize_file(artifact_of("seed/00000") / "bytes", 10);
  flip_a_bit(artifact_of("seed/00001") / "bytes");
  flip_a_bit(artifact_of("mix/00002") / "bytes");
  ASSERT_EQ(wait_for_end(farm, farm.submit(shot()), kPatience_s), "done");
  EXPECT_EQ(contents_of(farm), whole);
  for (const JobFact& job : jobs_of(farm)) {
    const bool was_damaged = job.name == "seed/00000" || job.name == "seed/00001" || job.name == "mix/00002";
    EXPECT_EQ(job.num_attempts, was_damaged ? 2 : 1) << job.name;
    EXPECT_TRUE(read_valid_manifest(artifact_of(job.name), /*check_hashes=*/true).has_value()) << job.name;
  }
  EXPECT_THAT(farm.ask({"why", shot(), "seed/00001"}), HasSubstr("output missing"));
}

/// Damage that comes while the shot runs, and that no time stamp tells of: found by who is about to compute upon it.
TEST_F(StoreTest, NothingIsComputedUponDamagedInput) {
  ShortWorker worker(farm, "worker", {.slots = 1});
  const auto id =
      submit("[seed]\nnum_jobs = 8\npause_ms = 300\n[mix]\nnum_jobs = 1\n[trouble]\nslow = 1\nslow_ms = 1\n");
  ASSERT_TRUE(wait_until([&] { return job_of(farm, "seed/00000").state == "done"; }, kPatience_s));
  const fs::path bytes = artifact_of("seed/00000") / "bytes";
  const auto time = fs::last_write_time(bytes);
  flip_a_bit(bytes);
  fs::last_write_time(bytes, time);
  EXPECT_EQ(wait_for_end(farm, id, kPatience_s), "done");
  for (const JobFact& job : jobs_of(farm))
    EXPECT_TRUE(read_valid_manifest(artifact_of(job.name), /*check_hashes=*/true).has_value()) << job.name;
  EXPECT_EQ(job_of(farm, "seed/00000").num_attempts, 2);
}

}  // namespace
}  // namespace vantage::faults
