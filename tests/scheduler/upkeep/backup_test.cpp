#include "scheduler/upkeep/backup.h"

#include <gtest/gtest.h>

#include "scheduler/farm/lock_file.h"
#include "scheduler/farm/turn_lock.h"
#include "scheduler/store/sqlite.h"
#include "schema/base/error.h"
#include "tests/support/fake_farm.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

class Backup : public testing::Test {
 protected:
  Backup() {
    write_file_atomically(state_dir() / "farm.key", "0123456789abcdef0123456789abcdef\n", 0600);
    write_file_atomically(state_dir() / "farm.toml", "[farm]\nlease_s = 9\n", 0600);
    farm_.submit();
  }
  fs::path state_dir() const { return farm_.database().parent_path(); }
  fs::path place(const char* name) const { return other_.path() / name; }
  std::string error_of_restore(const fs::path& from) {
    try {
      restore(state_dir(), from, 1);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::BadInput);
      return e.what();
    }
    return "";
  }
  FakeFarm farm_;
  FakeWorker worker_{"w", 2};
  TemporaryFolder other_;
};

TEST_F(Backup, OfAFarmThatWorksHoldsDatabaseSettingsAndKeyForTheOwnerOnly) {
  const BackupFacts facts = back_up(state_dir(), place("b"));
  EXPECT_EQ(facts.num_shots, 1);
  EXPECT_GT(facts.num_jobs, 0);
  EXPECT_EQ(read_file(place("b") / "farm.toml"), "[farm]\nlease_s = 9\n");
  const auto mode = fs::status(place("b") / "farm.key").permissions();
  EXPECT_EQ(mode, fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_THROW(back_up(state_dir(), place("b")), Error) << "a backup is never overwritten";
}

/// What was finished after the copy is found by its key; nothing is computed again.
TEST_F(Backup, RestoredFarmFindsWhatWasFinishedSinceAndEndsWithTheSameResults) {
  farm_.sync(worker_);
  back_up(state_dir(), place("b"));
  const std::int64_t epoch_before = farm_.dispatcher->epoch();
  farm_.run_to_end(worker_);
  const std::string result = farm_.job("encode").content;
  const auto runs_before = worker_.num_runs;
  farm_.kill();
  const Restored done = restore(state_dir(), place("b"), 7);
  EXPECT_TRUE(fs::exists(done.replaced));
  EXPECT_EQ(done.settings_kept, (std::vector<std::string>{"farm.toml", "farm.key"}));
  farm_.start();
  EXPECT_GT(farm_.dispatcher->epoch(), epoch_before + 1000) << "workers heed no orders of an epoch before their last";
  FakeWorker fresh("v", 2);
  farm_.submit();
  farm_.run_to_end(fresh);
  EXPECT_EQ(farm_.store->shot(farm_.shot)->state, "done");
  EXPECT_EQ(farm_.job("encode").content, result);
  EXPECT_TRUE(fresh.num_runs.empty()) << "results in the store are not made again";
}

TEST_F(Backup, RestoresIntoAnEmptyFolderWithItsSettings) {
  back_up(state_dir(), place("b"));
  const Restored done = restore(place("new"), place("b"), 7);
  EXPECT_TRUE(done.replaced.empty());
  EXPECT_EQ(done.settings_restored.size(), 2U);
  EXPECT_EQ(open_farm_to_read(place("new")).integer_or(0, "SELECT count(*) FROM shot"), 1);
}

TEST_F(Backup, RestoreIsRefusedWhileASchedulerRuns) {
  back_up(state_dir(), place("b"));
  const LockFile scheduler(state_dir() / "lock");
  EXPECT_NE(error_of_restore(place("b")).find("another scheduler"), std::string::npos);
}

TEST_F(Backup, RestoreRefusesWhatIsNoSoundCopyAndChangesNothing) {
  farm_.kill();
  back_up(state_dir(), place("b"));
  EXPECT_NE(error_of_restore(place("none")).find("no such copy"), std::string::npos);
  write_file_atomically(place("text"), std::string(4096, 'x'));
  EXPECT_NE(error_of_restore(place("text")).find("not a database"), std::string::npos);
  Sqlite(place("other"), Sqlite::Mode::ReadWrite).script("CREATE TABLE thing (a)");
  EXPECT_NE(error_of_restore(place("other")).find("no copy of a farm"), std::string::npos);
  Sqlite(place("b") / "farm.sqlite", Sqlite::Mode::ReadWrite).script("PRAGMA user_version = 9999");
  EXPECT_NE(error_of_restore(place("b")).find("made by a newer vantage"), std::string::npos);
  farm_.start();
  EXPECT_EQ(farm_.store->shot(farm_.shot)->state, "running");
}

}  // namespace
}  // namespace vantage
