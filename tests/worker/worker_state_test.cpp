#include "worker/worker_state.h"

#include <gtest/gtest.h>

#include <fstream>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "tests/support/temporary_folder.h"
#include "worker/child_link.h"

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

TEST(ChildLink, MessageBecomesOneShortLineOfWholeCharacters) {
  EXPECT_EQ(one_line("what\nwhere\n"), "what where");
  std::string text(299, 'x');
  text += "é and more";
  EXPECT_EQ(one_line(text), std::string(299, 'x'));
}

}  // namespace
}  // namespace vantage
