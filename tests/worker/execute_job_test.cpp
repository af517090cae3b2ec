#include "worker/execute_job.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <thread>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "tests/support/temporary_folder.h"
#include "worker/commit.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

struct ExecuteJobTest : ::testing::Test {
  TemporaryFolder folder;
  fs::path store = folder.path() / "store";
  int num_runs = 0;

  void SetUp() override { fs::create_directories(folder.path() / "scratch"); }

  JobFile job(const std::string& unit = "u") const {
    JobFile j;
    j.kind = "depth";
    j.version = 1;
    j.job = "depth/" + unit;
    j.shot = "s";
    j.unit = {{"what", unit}};
    j.store = store;
    j.key = job_key(j);
    return j;
  }
  ExecuteOptions options() const {
    return {.scratch_dir = folder.path() / "scratch", .input_patience_ms = 0, .on_progress = {}};
  }
  RunFunction writes(const std::string& text) {
    return [this, text](JobContext& context, const Json&) {
      ++num_runs;
      std::ofstream(context.out("maps/value.txt")) << text;
      context.figure("length", text.size());
    };
  }
  bool has_left_overs() const {
    return fs::exists(store / ".tmp") && fs::directory_iterator(store / ".tmp") != fs::directory_iterator();
  }
};

ErrorKind kind_of_failure(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& e) {
    return e.kind();
  }
  ADD_FAILURE() << "nothing was thrown";
  return ErrorKind::Bug;
}

TEST_F(ExecuteJobTest, LeavesAValidArtifactUnderItsKey) {
  const JobFile j = job();
  const Executed done = execute_job(j, writes("deep"), options());
  EXPECT_FALSE(done.was_there);
  EXPECT_EQ(done.folder, store / "depth" / j.key);
  EXPECT_EQ(read_file(done.folder / "maps/value.txt"), "deep");
  const auto manifest = read_valid_manifest(done.folder, true);
  ASSERT_TRUE(manifest);
  EXPECT_EQ(manifest->key, j.key);
  EXPECT_EQ(manifest->content, done.manifest.content);
  EXPECT_EQ(manifest->figures.at("length"), 4);
  EXPECT_EQ(manifest->provenance.at("unit").at("what"), "u");
  EXPECT_FALSE(has_left_overs());
}

TEST_F(ExecuteJobTest, FinishedJobIsFoundAndNotRunAgain) {
  execute_job(job(), writes("a"), options());
  const Executed again = execute_job(job(), writes("b"), options());
  EXPECT_TRUE(again.was_there);
  EXPECT_EQ(num_runs, 1);
  EXPECT_EQ(read_file(again.folder / "maps/value.txt"), "a");
}

TEST_F(ExecuteJobTest, FailureLeavesNothingBehind) {
  const RunFunction fails = [](JobContext& context, const Json&) {
    std::ofstream(context.out("half.txt")) << "half";
    throw Error(ErrorKind::BadInput, "cameras see nothing in common");
  };
  EXPECT_EQ(kind_of_failure([&] { execute_job(job(), fails, options()); }), ErrorKind::BadInput);
  EXPECT_FALSE(fs::exists(store / "depth" / job().key));
  EXPECT_FALSE(has_left_overs());
}

TEST_F(ExecuteJobTest, LoserOfTheRaceTakesTheWinnersArtifact) {
  const RunFunction loses = [this](JobContext& context, const Json& params) {
    if (num_runs == 0) execute_job(job(), writes("winner"), options());
    std::ofstream(context.out("maps/value.txt")) << "loser";
    static_cast<void>(params);
  };
  const Executed done = execute_job(job(), loses, options());
  EXPECT_TRUE(done.was_there);
  EXPECT_EQ(read_file(done.folder / "maps/value.txt"), "winner");
  EXPECT_FALSE(has_left_overs());
}

TEST_F(ExecuteJobTest, DamagedArtifactIsReplaced) {
  const Executed first = execute_job(job(), writes("whole"), options());
  fs::remove(first.folder / "maps/value.txt");
  const Executed second = execute_job(job(), writes("whole"), options());
  EXPECT_FALSE(second.was_there);
  EXPECT_EQ(num_runs, 2);
  EXPECT_TRUE(read_valid_manifest(second.folder, true));
  EXPECT_EQ(second.manifest.content, first.manifest.content);
  EXPECT_FALSE(has_left_overs());
}

TEST_F(ExecuteJobTest, InputsMustBeWhatTheJobWasPlannedFor) {
  const Executed input = execute_job(job("input"), writes("in"), options());
  JobFile j = job();
  j.inputs["depth/input"] = {input.folder, input.manifest.content};
  j.key = job_key(j);
  const RunFunction reads = [](JobContext& context, const Json&) {
    fs::copy_file(context.input("depth/input") / "maps/value.txt", context.out("copy.txt"));
  };
  EXPECT_EQ(read_file(execute_job(j, reads, options()).folder / "copy.txt"), "in");

  j.inputs["depth/input"].content = "other content";
  j.key = job_key(j);
  EXPECT_EQ(kind_of_failure([&] { execute_job(j, reads, options()); }), ErrorKind::Transient);
  fs::remove_all(input.folder);
  EXPECT_EQ(kind_of_failure([&] { execute_job(j, reads, options()); }), ErrorKind::Transient);
}

TEST_F(ExecuteJobTest, DamagedInputIsNeverComputedUpon) {
  const Executed input = execute_job(job("input"), writes("in"), options());
  JobFile j = job();
  j.inputs["depth/input"] = {input.folder, input.manifest.content};
  j.key = job_key(j);
  for (const char* damaged : {"on", "shorter"}) {  // a flipped bit, another size
    std::ofstream(input.folder / "maps/value.txt") << damaged;
    try {
      execute_job(j, writes("x"), options());
      FAIL() << "computed upon a damaged input";
    } catch (const DamagedInput& e) {
      EXPECT_EQ(e.job(), "depth/input");
      EXPECT_NE(std::string(e.what()).find(input.folder.string()), std::string::npos);
    }
  }
  EXPECT_EQ(num_runs, 1);
}

TEST_F(ExecuteJobTest, InputThatShowsLateIsWaitedFor) {
  const Executed input = execute_job(job("input"), writes("in"), options());
  JobFile j = job();
  j.inputs["depth/input"] = {input.folder, input.manifest.content};
  j.key = job_key(j);
  const fs::path away = folder.path() / "away";
  fs::rename(input.folder, away);
  std::thread storage([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    fs::rename(away, input.folder);
  });
  ExecuteOptions patient = options();
  patient.input_patience_ms = 20'000;
  EXPECT_FALSE(execute_job(j, writes("x"), patient).was_there);
  storage.join();
}

TEST_F(ExecuteJobTest, EditedSourceIsNotBelievedUnderTheOldKey) {
  const fs::path footage = folder.path() / "footage.mp4";
  write_file_atomically(footage, "before");
  JobFile j = job();
  j.sources["footage"] = {footage, hash_file(footage)};
  j.key = job_key(j);
  write_file_atomically(footage, "after!");
  EXPECT_EQ(kind_of_failure([&] { execute_job(j, writes("x"), options()); }), ErrorKind::Transient);
  fs::remove(footage);
  EXPECT_EQ(kind_of_failure([&] { execute_job(j, writes("x"), options()); }), ErrorKind::BadInput);
  EXPECT_EQ(num_runs, 0);
}

TEST_F(ExecuteJobTest, KeyThatIsNotTheContentsHashIsRefused) {
  JobFile j = job();
  j.params = {{"edited", true}};
  EXPECT_EQ(kind_of_failure([&] { execute_job(j, writes("x"), options()); }), ErrorKind::BadInput);
}

TEST_F(ExecuteJobTest, FolderOfAKilledAttemptGoesWithTheNext) {
  const pid_t pid = fork();
  if (pid == 0) {
    const PrivateFolder mine(store, job().key);
    std::ofstream(mine.path() / "half.txt") << "half";
    kill(getpid(), SIGKILL);
  }
  waitpid(pid, nullptr, 0);
  ASSERT_TRUE(has_left_overs());
  execute_job(job("another"), writes("x"), options());
  EXPECT_TRUE(has_left_overs()) << "not ours to judge";
  execute_job(job(), writes("x"), options());
  EXPECT_FALSE(has_left_overs());
}

TEST_F(ExecuteJobTest, FolderOfAKilledChildIsRemovedByItsPid) {
  const PrivateFolder mine(store, job().key);
  remove_private_folders_of(store, job().key, getpid() + 1);
  EXPECT_TRUE(fs::exists(mine.path()));
  remove_private_folders_of(store, job().key, getpid());
  EXPECT_FALSE(fs::exists(mine.path()));
}

TEST_F(ExecuteJobTest, WorldsExceptionsAreSorted) {
  EXPECT_EQ(error_of(std::bad_alloc(), store).kind(), ErrorKind::Resource);
  EXPECT_EQ(error_of(std::system_error(std::make_error_code(std::errc::no_space_on_device)), store).kind(),
            ErrorKind::Resource);
  EXPECT_EQ(error_of(std::system_error(std::make_error_code(std::errc::io_error)), store).kind(), ErrorKind::Transient);
  EXPECT_EQ(error_of(std::logic_error("x"), store).kind(), ErrorKind::Bug);
  EXPECT_EQ(error_of(std::runtime_error("Insufficient memory"), store).kind(), ErrorKind::Resource);
  EXPECT_EQ(error_of(Error(ErrorKind::Crash, "x"), store).kind(), ErrorKind::Crash);
}

}  // namespace
}  // namespace vantage
