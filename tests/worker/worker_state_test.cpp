#include "worker/worker_state.h"

#include <gtest/gtest.h>

#include <fstream>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

TEST(WorkerState, IdStaysAndIncarnationRisesOverRestarts) {
  const TemporaryFolder folder;
  std::string id;
  std::int64_t incarnation = 0;
  {
    const WorkerState state(folder.path());
    id = state.worker_id();
    incarnation = state.incarnation();
  }
  const WorkerState state(folder.path());
  EXPECT_EQ(state.worker_id(), id);
  EXPECT_GT(state.incarnation(), incarnation);
}

TEST(WorkerState, SecondWorkerInTheSameFolderIsRefused) {
  const TemporaryFolder folder;
  const WorkerState state(folder.path());
  EXPECT_THROW(WorkerState(folder.path()), Error);
}

TEST(WorkerState, OutboxSurvivesARestart) {
  const TemporaryFolder folder;
  DoneAttempt done{{5, 2, -77}, Outcome::Crashed, "crash", "killed by signal 11", "", 0, 11, 1234, 56};
  {
    const WorkerState state(folder.path());
    EXPECT_TRUE(state.read_outbox().empty());
    state.write_outbox({done});
  }
  const auto read = WorkerState(folder.path()).read_outbox();
  ASSERT_EQ(read.size(), 1U);
  EXPECT_EQ(read[0].ref, done.ref);
  EXPECT_EQ(read[0].outcome, Outcome::Crashed);
  EXPECT_EQ(read[0].message, done.message);
  EXPECT_EQ(read[0].signal, 11);
  EXPECT_EQ(read[0].wall_ms, 1234);
  EXPECT_EQ(read[0].peak_rss_mb, 56);
}

TEST(WorkerState, DamagedOutboxDoesNotKeepTheWorkerFromStarting) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "outbox.json") << "[{\"job_id\": 1,";
  EXPECT_TRUE(WorkerState(folder.path()).read_outbox().empty());
}

TEST(AttemptFiles, OutcomeSurvivesTheFile) {
  const TemporaryFolder folder;
  EXPECT_FALSE(read_outcome(folder.path() / "outcome.json"));
  DoneAttempt failed;
  failed.outcome = Outcome::Failed;
  failed.error_kind = "resource";
  failed.message = "no disk space left";
  write_outcome(folder.path() / "outcome.json", failed);
  const auto read = read_outcome(folder.path() / "outcome.json");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->outcome, Outcome::Failed);
  EXPECT_EQ(read->error_kind, "resource");
  EXPECT_EQ(read->message, "no disk space left");
}

TEST(AttemptFiles, HalfWrittenOutcomeIsNone) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "outcome.json") << "{\"done\": true,";
  EXPECT_FALSE(read_outcome(folder.path() / "outcome.json"));
}

TEST(AttemptFiles, ProgressIsWrittenAtMostFiveTimesASecond) {
  const TemporaryFolder folder;
  ProgressWriter writer(folder.path() / "progress.json");
  EXPECT_FALSE(read_progress(folder.path() / "progress.json"));
  writer.write(0.25, "warping");
  writer.write(0.5, "blending");
  const auto progress = read_progress(folder.path() / "progress.json");
  ASSERT_TRUE(progress);
  EXPECT_EQ(progress->fraction, 0.25);
  EXPECT_EQ(progress->phase, "warping");
}

TEST(AttemptFiles, MessageBecomesOneShortLineOfWholeCharacters) {
  EXPECT_EQ(one_line("what\nwhere\n"), "what where");
  std::string text(299, 'x');
  text += "é and more";
  EXPECT_EQ(one_line(text), std::string(299, 'x'));
}

}  // namespace
}  // namespace vantage
