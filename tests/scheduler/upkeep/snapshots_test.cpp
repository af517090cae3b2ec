#include "scheduler/upkeep/snapshots.h"

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "scheduler/store/store.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

constexpr std::int64_t kHourMs = 3'600'000;
constexpr std::int64_t kNoonMs = 1'795'348'800'000;  // 2026-11-22 12:00 UTC

class Snapshots : public testing::Test {
 protected:
  fs::path database() const { return folder_.path() / "farm.sqlite"; }
  void make_farm() const { Store(database(), system_clock()).set_meta("farm_id", "f"); }
  TemporaryFolder folder_;
};

TEST_F(Snapshots, AreOneFileThatIsReadableOnItsOwn) {
  Store store(database(), system_clock());
  store.set_meta("word", "kept");
  const auto made = take_snapshot(folder_.path(), kNoonMs, nullptr);
  ASSERT_TRUE(made);
  EXPECT_EQ(made->filename(), "farm-20261122T120000Z.sqlite");
  Sqlite copy(*made, Sqlite::Mode::ReadOnly);
  EXPECT_EQ(copy.text_or("", "SELECT value FROM meta WHERE key = 'word'"), "kept");
  EXPECT_EQ(copy.text_or("", "PRAGMA journal_mode"), "delete");
  EXPECT_FALSE(fs::exists(made->string() + "-wal"));
}

/// Pairs of rows are written together; a copy that mixes two moments has one without the other.
TEST_F(Snapshots, HoldOneMomentWhileTheFarmWrites) {
  Store store(database(), system_clock());
  store.db().script("CREATE TABLE pair (a INTEGER, filler TEXT)");
  std::atomic<bool> stop{false};
  std::jthread writer([&] {
    for (int i = 0; !stop; ++i) {
      store.begin();
      store.db().run("INSERT INTO pair VALUES (?, ?)", i, std::string(3000, 'x'));
      store.db().run("INSERT INTO pair VALUES (?, ?)", -i, std::string(3000, 'y'));
      store.commit();
    }
  });
  for (int i = 0; i < 5; ++i) {
    const auto made = take_snapshot(folder_.path(), kNoonMs + i * 1000, nullptr);
    ASSERT_TRUE(made);
    Sqlite copy(*made, Sqlite::Mode::ReadOnly);
    EXPECT_EQ(copy.integer_or(-1, "SELECT sum(a) FROM pair"), 0);
    EXPECT_EQ(copy.integer_or(-1, "SELECT count(*) % 2 FROM pair"), 0);
  }
  stop = true;
}

TEST_F(Snapshots, LeaveNothingWhenToldToStop) {
  make_farm();
  Sqlite db = open_farm_to_read(folder_.path());
  int num_slices = 0;
  Store(database(), system_clock())
      .db()
      .script(
          "CREATE TABLE big AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 3000) "
          "SELECT i, hex(zeroblob(4000)) FROM n");
  EXPECT_FALSE(db.copy_to(folder_.path() / "copy", [&] { return ++num_slices < 2; }));
  EXPECT_EQ(num_slices, 2);
  EXPECT_FALSE(fs::exists(folder_.path() / "copy"));
  EXPECT_FALSE(fs::exists(folder_.path() / "copy.tmp"));
}

TEST_F(Snapshots, KeepTheNewestOfEachHourAndDay) {
  std::vector<SnapshotFile> files;
  for (int half_hours = 0; half_hours < 48 * 10; ++half_hours)
    files.push_back({fmt::format("{}", half_hours), kNoonMs + kHourMs / 2 - half_hours * kHourMs / 2});
  const auto gone = superfluous(files, {.every_min = 30, .keep_hourly = 24, .keep_daily = 7});
  EXPECT_EQ(files.size() - gone.size(), 24U + 5U) << "the last two days lie within the hours";
  for (const SnapshotFile& file : gone) EXPECT_NE(file.at_ms, files.front().at_ms);
}

TEST_F(Snapshots, ADamagedDatabaseIsRefusedAndTheNewestSoundCopyIsNamed) {
  make_farm();
  const auto sound = take_snapshot(folder_.path(), kNoonMs, nullptr);
  write_file_atomically(snapshot_at(folder_.path(), kNoonMs + kHourMs), "no database");
  for (const bool garbled : {true, false}) {
    if (garbled) {
      std::fstream file(database(), std::ios::in | std::ios::out | std::ios::binary);
      file.seekp(5000);
      file << std::string(20'000, '\xff');
    } else {
      write_file_atomically(database(),
                            "not a database at all, but long enough to have a header that is wrong .........."
                            "....................................................");
    }
    try {
      const Store store(database(), system_clock());
      ADD_FAILURE() << "opened a damaged database";
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find("vantage restore --state"), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find(sound->string()), std::string::npos) << e.what();
    }
  }
}

}  // namespace
}  // namespace vantage
