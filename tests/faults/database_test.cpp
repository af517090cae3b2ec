/// The farm's database: held by another, on a full disk, cut off, from the future.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "scheduler/store/sqlite.h"
#include "tests/faults/farm_facts.h"
#include "tests/support/temporary_folder.h"

namespace vantage::faults {
namespace {
namespace fs = std::filesystem;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;

class Database : public testing::Test {
 protected:
  Database() : farm(folder.path()) {}
  fs::path shot() const { return folder.path() / "shot"; }
  fs::path file() const { return farm.state() / "farm.sqlite"; }
  std::int64_t submit(const std::string& tables) {
    write_short_shot(shot(), tables);
    return farm.submit(shot());
  }
  /// What a scheduler prints that refuses to start.
  std::string refusal() {
    const std::size_t before = farm.printed().size();
    farm.launch();
    EXPECT_NE(farm.scheduler().wait(), 0);
    return farm.printed().substr(before);
  }

  TemporaryFolder folder;
  ShortFarm farm;
};

TEST_F(Database, AnotherProcessThatHoldsItForAWhileOnlyDelays) {
  farm.start();
  ShortWorker worker(farm, "worker");
  const auto id = submit("[seed]\nnum_jobs = 60\npause_ms = 50\n");
  ASSERT_TRUE(wait_until([&] { return num_jobs_in(farm, "done") >= 5; }, 30));
  {
    Sqlite other(file(), Sqlite::Mode::ReadWrite);
    other.script("BEGIN IMMEDIATE");
    usleep(3'000'000);
    other.script("ROLLBACK");
  }
  EXPECT_EQ(wait_for_end(farm, id, 60), "done");
  EXPECT_FALSE(farm.scheduler().ended()) << farm.printed();
  expect_all_done_once(farm, shot());
}

TEST_F(Database, OnAFullDiskTheSchedulerSaysSoAndGoesOnWhenThereIsRoom) {
  if (mount("vantage-test", farm.state().c_str(), "tmpfs", 0, "size=8m") != 0)
    GTEST_SKIP() << "a tmpfs cannot be mounted here: " << strerror(errno);
  farm.start();
  ShortWorker worker(farm, "worker");
  const auto id = submit("[seed]\nnum_jobs = 300\npause_ms = 20\n");
  ASSERT_TRUE(wait_until([&] { return num_jobs_in(farm, "done") >= 5; }, 30));
  std::ofstream(farm.state() / "ballast") << std::string(fs::space(farm.state()).available, 'b') << std::flush;
  EXPECT_TRUE(wait_until([&] { return farm.printed().find("full") != std::string::npos; }, 30)) << farm.printed();
  fs::remove(farm.state() / "ballast");
  if (farm.scheduler().ended()) farm.start();  // as whoever keeps it alive does
  EXPECT_EQ(wait_for_end(farm, id, 60), "done");
  expect_all_done_once(farm, shot());
  farm.kill();
  umount2(farm.state().c_str(), MNT_DETACH);
}

TEST_F(Database, ACutOffFileIsRefusedWithAWayOut) {
  farm.start();
  ShortWorker worker(farm, "worker");
  ASSERT_EQ(wait_for_end(farm, submit("[seed]\nnum_jobs = 50\n"), 30), "done");
  farm.kill();
  for (const char* journal : {"-wal", "-shm"}) fs::remove(file().string() + journal);
  fs::resize_file(file(), fs::file_size(file()) / 2 / 4096 * 4096);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("farm.sqlite"),
                               AnyOf(HasSubstr("vantage restore"), HasSubstr("submit the shots again"))));
}

TEST_F(Database, ANewerVersionIsRefused) {
  farm.start();
  farm.kill();
  Sqlite(file(), Sqlite::Mode::ReadWrite).script("PRAGMA user_version = 9999");
  EXPECT_THAT(refusal(), AllOf(HasSubstr("farm.sqlite"), HasSubstr("newer")));
}

}  // namespace
}  // namespace vantage::faults
