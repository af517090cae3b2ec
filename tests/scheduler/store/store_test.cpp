#include "scheduler/store/store.h"

#include <gtest/gtest.h>

#include <chrono>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

class StoreTest : public testing::Test {
 protected:
  StoreTest()
      : store(folder.path() / "farm.sqlite", system_clock()), shot(store.submit_shot("/shots/a", "a", "", 0).id) {}

  JobId add(const std::string& name, int priority = 0, int stage = 0, JobState state = JobState::Ready) {
    JobRow row;
    row.shot = shot;
    row.name = name;
    row.kind = "k";
    row.generation = 1;
    row.priority = priority;
    row.stage = stage;
    row.cores = 1;
    row.ram_mb = 100;
    const JobId id = store.insert_job(row);
    if (state != JobState::Blocked) store.move(id, state, "");
    return id;
  }
  std::string next(Store::Fit fit = {
                       .free_cores = 4, .free_ram_mb = 1000, .largest_cores = 4, .largest_ram_mb = 1000}) {
    const auto job = store.next_to_claim(fit);
    return job ? job->name : "";
  }

  TemporaryFolder folder;
  Store store;
  ShotId shot;
};

TEST_F(StoreTest, RefusesAMoveThatTheTableDoesNotHave) {
  const JobId job = add("a", 0, 0, JobState::Blocked);
  EXPECT_THROW(store.move(job, JobState::Running, ""), Error);
  EXPECT_EQ(store.job(job)->state, JobState::Blocked);
}

TEST_F(StoreTest, EveryMoveWritesAnEvent) {
  const JobId job = add("a");
  store.move(job, JobState::Leased, "first run");
  EXPECT_EQ(store.db().text_or("", "SELECT text FROM event WHERE job_id = ? ORDER BY id DESC", job.value),
            "leased: first run");
}

TEST_F(StoreTest, AMoveToDoneAndBackKeepsWhatDependentsWaitFor) {
  const JobId need = add("need"), child = add("child", 0, 0, JobState::Blocked);
  store.set_needs(child, {need}, 1);
  store.move(need, JobState::Done, "");
  EXPECT_EQ(store.job(child)->num_unmet, 0);
  store.move(need, JobState::Ready, "output missing");
  EXPECT_EQ(store.job(child)->num_unmet, 1);
}

TEST_F(StoreTest, ClaimsByPriorityThenLaterStageThenAge) {
  add("early stage", 0, 1), add("late stage", 0, 5), add("late stage, younger", 0, 5), add("urgent", 9, 0);
  for (const std::string expected : {"urgent", "late stage", "late stage, younger", "early stage"}) {
    ASSERT_EQ(next(), expected);
    store.move(store.find_job(shot, expected)->id, JobState::Leased, "");
  }
  EXPECT_EQ(next(), "");
}

TEST_F(StoreTest, ClaimsOnlyWhatFitsAndGivesAGiantJobTheLargestWorkerWhole) {
  const JobId big = add("big");
  store.set_resources(big, 5000, 60);
  EXPECT_EQ(next({.free_cores = 1, .free_ram_mb = 900, .largest_cores = 4, .largest_ram_mb = 1000}), "");
  EXPECT_EQ(next({.free_cores = 1, .free_ram_mb = 1000, .largest_cores = 4, .largest_ram_mb = 1000}), "big");
}

TEST_F(StoreTest, ClaimsAJobThatCrashedOnlyToRunAlone) {
  store.set_retry(add("crashed"), 0, 1, 0);
  EXPECT_EQ(next(), "");
  EXPECT_EQ(next({.free_cores = 4, .free_ram_mb = 1000, .largest_cores = 4, .largest_ram_mb = 1000, .alone = true}),
            "crashed");
}

TEST_F(StoreTest, ClaimsNothingOfAPausedShotNorBeforeItsTime) {
  const JobId job = add("a");
  store.set_retry(job, 1, 0, system_clock().wall_ms() + 60'000);
  EXPECT_EQ(next(), "");
  store.set_retry(job, 1, 0, 0);
  store.set_shot_state(shot, "paused", "");
  EXPECT_EQ(next(), "");
  store.set_shot_state(shot, "running", "");
  EXPECT_EQ(next(), "a");
}

TEST_F(StoreTest, AttemptNumbersAreNeverReusedAndTokensMustMatch) {
  const JobId job = add("a");
  const AttemptRef first = store.begin_attempt(*store.job(job), "w", 11, "log");
  const AttemptRef second = store.begin_attempt(*store.job(job), "w", 12, "log");
  EXPECT_EQ(first.number + 1, second.number);
  EXPECT_TRUE(store.attempt(first).has_value());
  EXPECT_FALSE(store.attempt({.job_id = job.value, .number = first.number, .token = 99}).has_value());
}

TEST_F(StoreTest, SourceHashFollowsTheContentNotTheTime) {
  const auto file = folder.path() / "footage.mp4";
  write_file_atomically(file, "one");
  const std::string one = store.source_hash(file);
  std::filesystem::last_write_time(file, std::filesystem::file_time_type::clock::now() + std::chrono::hours(1));
  EXPECT_EQ(store.source_hash(file), one);
  write_file_atomically(file, "two");
  EXPECT_NE(store.source_hash(file), one);
  std::filesystem::remove(file);
  EXPECT_THROW(store.source_hash(file), Error);
}

TEST_F(StoreTest, GuardedUndoesOnlyWhatFailed) {
  store.begin();
  store.set_meta("kept", "1");
  EXPECT_THROW(store.guarded([&] {
    store.set_meta("undone", "1");
    throw Error(ErrorKind::BadInput, "no");
  }),
               Error);
  store.commit();
  EXPECT_EQ(store.meta("kept"), "1");
  EXPECT_EQ(store.meta("undone"), "");
}

TEST(JobState, WordsAndStatesAreOneToOne) {
  for (const auto word : kJobStateNames) EXPECT_EQ(to_string(job_state_from(word).value()), word);
  EXPECT_FALSE(job_state_from("sleeping").has_value());
}

TEST(JobState, TableHasThePathOfAGoodJobAndNoShortCuts) {
  using enum JobState;
  static_assert(may_move(Blocked, Ready) && may_move(Ready, Leased) && may_move(Leased, Running) &&
                may_move(Running, Done));
  static_assert(may_move(Running, Reconnect) && may_move(Reconnect, Running) && may_move(Reconnect, Ready));
  static_assert(!may_move(Blocked, Running) && !may_move(Blocked, Done) && !may_move(Done, Failed) &&
                !may_move(Done, Leased));
  static_assert(!may_move(Done, Canceled) && !may_move(Failed, Running) && !may_move(Ready, Reconnect));
}

}  // namespace
}  // namespace vantage
