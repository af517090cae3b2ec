#include "scheduler/farm/farm.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <functional>
#include <thread>

#include "scheduler/farm/lock_file.h"
#include "scheduler/farm/progress_query.h"
#include "scheduler/store/sqlite.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/messages/endpoint.h"
#include "tests/support/fake_farm.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

template <class Fn>
std::string error_of(Fn&& fn) {
  try {
    fn();
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

class FarmTest : public testing::Test {
 protected:
  FarmScheduler::Options options() const {
    FarmScheduler::Options o;
    o.state_dir = folder.path() / "farm";
    return o;
  }
  TemporaryFolder folder;
};

TEST_F(FarmTest, MakesItsKeyForItsOwnerOnlyAndKeepsIt) {
  std::string id;
  {
    FarmScheduler farm(options());
    id = farm.farm_id();
    struct stat info {};
    ASSERT_EQ(stat(farm.key_file().c_str(), &info), 0);
    EXPECT_EQ(info.st_mode & 0777U, 0600U);
    EXPECT_THAT(farm.bus_url(), HasSubstr("tcpq://127.0.0.1:"));
  }
  EXPECT_EQ(FarmScheduler(options()).farm_id(), id);
}

TEST_F(FarmTest, SecondSchedulerOnTheSameFolderIsRefused) {
  FarmScheduler farm(options());
  EXPECT_THAT(error_of([&] { FarmScheduler second(options()); }), HasSubstr("another scheduler (process "));
}

TEST_F(FarmTest, BadShotComesBackThroughTheFutureAndTheFarmGoesOn) {
  FarmScheduler farm(options());
  EXPECT_THAT(error_of([&] { farm.submit({.folder = folder.path() / "none", .until_kind = "", .priority = 0}).get(); }),
              HasSubstr("none"));
  EXPECT_FALSE(fs::exists(folder.path() / "none")) << "a mistyped name must not become a folder";
  EXPECT_THAT(error_of([&] { farm.command({.verb = Command::Verb::Pause, .shot = ShotId{7}}).get(); }),
              HasSubstr("no such shot"));
  EXPECT_TRUE(farm.all_progress().empty());
}

TEST_F(FarmTest, SubmittedShotReachesAWorkerOverTheBus) {
  const fs::path shot = folder.path() / "shot";
  fs::create_directories(shot);
  write_file_atomically(shot / "a.mp4", "a");
  write_file_atomically(shot / "b.mp4", "b");
  write_file_atomically(shot / "shot.toml",
                        "[shot]\nname = \"s\"\n[[camera]]\nname = \"a\"\nfootage = \"a.mp4\"\n"
                        "[[camera]]\nname = \"b\"\nfootage = \"b.mp4\"\n");
  FarmScheduler farm(options());
  const SubmitResult submitted = farm.submit({.folder = shot, .until_kind = "ingest", .priority = 0}).get();
  ASSERT_GT(submitted.num_jobs, 0);
  ASSERT_TRUE(farm.progress(submitted.shot).has_value());

  FakeWorker worker("w", 2);
  LcmEndpoint endpoint({.url = farm.bus_url(),
                        .farm = read_farm_key(farm.key_file()),
                        .role = LcmEndpoint::Role::Worker,
                        .sender = "w",
                        .incarnation = 1});
  std::optional<ShotProgress> last;
  for (int i = 0; i < 200 && !last; ++i) {  // until done; a lost message only costs one more round
    endpoint.publish(worker.report());
    for (const Message& message : endpoint.wait(std::chrono::milliseconds(50)))
      if (const auto* orders = std::get_if<WorkerOrders>(&message)) worker.take(*orders);
    while (!worker.held().empty()) worker.finish(worker.held().begin()->first);
    last = farm.wait(submitted.shot, 1);
  }
  ASSERT_TRUE(last.has_value());
  EXPECT_EQ(last->state, "done");
  EXPECT_EQ(last->num_finished(), submitted.num_jobs);

  Sqlite reader = open_farm_to_read(farm.state_dir());
  EXPECT_EQ(read_progress(reader, submitted.shot, kind_names())->state, "done");
}

TEST_F(FarmTest, DatabaseThatAnotherProgramHoldsStopsNothingForGood) {
  FarmScheduler farm(options());
  const auto comes_true = [](const std::function<bool()>& what) {
    for (int i = 0; i < 1'000; ++i) {
      if (what()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return false;
  };
  {
    Sqlite other(farm.state_dir() / "farm.sqlite", Sqlite::Mode::ReadWrite);
    ASSERT_TRUE(comes_true([&] {  // the farm holds it only for moments
      try {
        other.script("BEGIN IMMEDIATE");
        return true;
      } catch (const DatabaseError&) {
        return false;
      }
    }));
    ASSERT_TRUE(comes_true([&] { return !farm.health().trouble.empty(); }));
    EXPECT_THAT(farm.health().trouble, HasSubstr("the database cannot be written"));
    EXPECT_THAT(farm.health().trouble, HasSubstr("locked"));
    EXPECT_GT(farm.health().since_wall_ms, 0);
    EXPECT_THAT(error_of([&] { farm.command({.verb = Command::Verb::Pause, .shot = ShotId{7}}).get(); }),
                HasSubstr("cannot be written"))
        << "whoever asks is told at once";
    other.script("ROLLBACK");
  }
  EXPECT_TRUE(comes_true([&] { return farm.health().trouble.empty(); }));
  EXPECT_THAT(error_of([&] { farm.command({.verb = Command::Verb::Pause, .shot = ShotId{7}}).get(); }),
              HasSubstr("no such shot"));
}

TEST_F(FarmTest, StoreThatCannotBeMadeIsSaidInOneLine) {
  write_file_atomically(folder.path() / ".vantage", "a file where the folder should be");
  EXPECT_THAT(error_of([&] { check_store(folder.path()); }), HasSubstr("the store cannot be made"));
}

}  // namespace
}  // namespace vantage
