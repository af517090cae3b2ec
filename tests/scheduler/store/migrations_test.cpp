#include "scheduler/store/migrations.h"

#include <gtest/gtest.h>

#include "schema/base/error.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

const Migration kFirst{1, "CREATE TABLE thing (name TEXT)"};
const Migration kSecond{2, "ALTER TABLE thing ADD COLUMN size INTEGER NOT NULL DEFAULT 7"};

TEST(Migrations, BringAnOldDatabaseForwardAndKeepACopyOfIt) {
  TemporaryFolder folder;
  const auto file = folder.path() / "farm.sqlite";
  {
    Sqlite db(file, Sqlite::Mode::ReadWrite);
    migrate(db, {kFirst});
    db.run("INSERT INTO thing (name) VALUES ('kept')");
  }
  Sqlite db(file, Sqlite::Mode::ReadWrite);
  migrate(db, {kFirst, kSecond});
  EXPECT_EQ(db.integer_or(0, "SELECT size FROM thing WHERE name = 'kept'"), 7);

  Sqlite copy(file.string() + ".before-2", Sqlite::Mode::ReadOnly);
  EXPECT_EQ(copy.integer_or(0, "SELECT count(*) FROM thing"), 1);
  EXPECT_EQ(copy.integer_or(0, "PRAGMA user_version"), 1);
}

TEST(Migrations, MakeNoCopyOfANewDatabase) {
  TemporaryFolder folder;
  Sqlite db(folder.path() / "farm.sqlite", Sqlite::Mode::ReadWrite);
  migrate(db, {kFirst, kSecond});
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "farm.sqlite.before-2"));
}

TEST(Migrations, RefuseANewerDatabase) {
  TemporaryFolder folder;
  Sqlite db(folder.path() / "farm.sqlite", Sqlite::Mode::ReadWrite);
  migrate(db, {kFirst, kSecond});
  try {
    migrate(db, {kFirst});
    FAIL() << "went back in versions";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::BadInput);
    EXPECT_NE(std::string(e.what()).find("made by a newer vantage"), std::string::npos) << e.what();
  }
}

TEST(Migrations, LeaveTheOldVersionWhenAStepFails) {
  TemporaryFolder folder;
  Sqlite db(folder.path() / "farm.sqlite", Sqlite::Mode::ReadWrite);
  migrate(db, {kFirst});
  const Migration wrong{2, "ALTER TABLE thing ADD COLUMN size INTEGER; SELECT nonsense"};
  EXPECT_THROW(migrate(db, {kFirst, wrong}), Error);
  EXPECT_EQ(db.integer_or(0, "PRAGMA user_version"), 1);
  EXPECT_EQ(db.integer_or(0, "SELECT count(*) FROM pragma_table_info('thing')"), 1);
}

TEST(Migrations, BuiltInOnesAreNumberedFromOneWithoutGaps) {
  int expected = 1;
  for (const auto& step : all_migrations()) EXPECT_EQ(step.version, expected++);
  EXPECT_GT(expected, 1);
}

TEST(Sqlite, ReadOnlyConnectionCannotWriteAndSeesCommittedRows) {
  TemporaryFolder folder;
  const auto file = folder.path() / "farm.sqlite";
  Sqlite writer(file, Sqlite::Mode::ReadWrite);
  writer.script("CREATE TABLE thing (name TEXT); INSERT INTO thing VALUES ('a')");
  Sqlite reader = open_farm_to_read(folder.path());
  EXPECT_EQ(reader.text_or("", "SELECT name FROM thing"), "a");
  EXPECT_THROW(reader.run("DELETE FROM thing"), Error);
}

TEST(Sqlite, SaysWhereThereIsNoFarm) {
  TemporaryFolder folder;
  EXPECT_THROW(open_farm_to_read(folder.path()), Error);
}

}  // namespace
}  // namespace vantage
