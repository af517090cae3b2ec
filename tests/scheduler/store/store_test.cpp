#include "scheduler/store/store.h"

#include <gtest/gtest.h>

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
  /// The best of all that can be claimed.
  std::string next() {
    const auto classes = store.ready_classes();
    return classes.empty() ? "" : store.best_of_class(classes.front().id, 1).at(0).name;
  }
  std::int64_t counted(const std::string& state) {
    store.begin();
    store.commit();
    return store.db().integer_or(0, "SELECT sum(num) FROM job_count WHERE shot_id = ? AND state = ?", shot.value,
                                 state);
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

TEST_F(StoreTest, AMoveWritesAnEventUnlessAnotherRowSaysIt) {
  const JobId job = add("a");
  const auto num_events = [&] {
    return store.db().integer_or(0, "SELECT count(*) FROM event WHERE job_id = ?", job.value);
  };
  EXPECT_EQ(num_events(), 0) << "the job's row says that it is ready";
  store.begin_attempt(*store.job(job), {.job_id = job.value, .number = 1, .token = 1}, "w", "log");
  EXPECT_EQ(num_events(), 0) << "the attempt's row says that it is leased";
  store.move(job, JobState::Ready, "worker w was restarted");
  EXPECT_EQ(store.db().text_or("", "SELECT text FROM event WHERE job_id = ?", job.value),
            "ready: worker w was restarted");
}

TEST_F(StoreTest, CountsFollowEveryChangeAndAreUndoneWithIt) {
  const JobId a = add("a"), b = add("b");
  EXPECT_EQ(counted("ready"), 2);
  store.begin();
  store.move(a, JobState::Leased, "");
  EXPECT_THROW(store.guarded([&] {
    store.move(b, JobState::Leased, "");
    throw Error(ErrorKind::BadInput, "no");
  }),
               Error);
  store.commit();
  EXPECT_EQ(counted("leased"), 1);
  store.begin();
  store.move(b, JobState::Leased, "");
  store.rollback();
  EXPECT_EQ(counted("leased"), 1);
  EXPECT_EQ(next(), "b");
}

TEST_F(StoreTest, CountsAreOfThePresentGeneration) {
  const JobId kept = add("kept");
  add("dropped");
  const ShotRow again = store.submit_shot("/shots/a", "a", "", 0);
  EXPECT_EQ(counted("ready"), 0);
  store.set_generation(kept, again.generation);
  EXPECT_EQ(counted("ready"), 1);
  EXPECT_TRUE(store.has_planned_unfinished(shot));
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

TEST_F(StoreTest, AJobThatAsksForMoreOrHasCrashedIsOfAnotherClass) {
  const JobId plain = add("plain"), big = add("big"), crashed = add("crashed");
  EXPECT_EQ(store.ready_classes().size(), 1U);
  store.set_resources(big, 5000, 60);
  store.set_retry(crashed, 0, 1, 0);
  const auto classes = store.ready_classes();
  ASSERT_EQ(classes.size(), 3U);
  EXPECT_EQ(classes[0].first, plain);
  EXPECT_EQ(classes[1].ram_mb, 5000);
  EXPECT_TRUE(classes[2].alone);
}

TEST_F(StoreTest, ClaimsNothingOfAPausedShotNorBeforeItsTime) {
  const JobId job = add("a");
  store.set_retry(job, 1, 0, system_clock().wall_ms() + 60'000);
  store.wake_waiting();
  EXPECT_EQ(next(), "");
  store.set_retry(job, 1, 0, system_clock().wall_ms() - 1);
  EXPECT_EQ(next(), "");
  store.wake_waiting();
  EXPECT_EQ(next(), "a");
  store.set_shot_state(shot, "paused", "");
  EXPECT_EQ(next(), "");
  store.set_shot_state(shot, "running", "");
  EXPECT_EQ(next(), "a");
}

TEST_F(StoreTest, ATryThatWasPutOffForAnHourByAClockSetBackIsDue) {
  const JobId job = add("a");
  store.set_retry(job, 1, 0, system_clock().wall_ms() + 5 * 3'600'000);
  store.wake_waiting();
  EXPECT_EQ(next(), "a");
}

TEST_F(StoreTest, AttemptNumbersAreNeverReusedAndTokensMustMatch) {
  const JobId job = add("a");
  const AttemptRef first{.job_id = job.value, .number = 1, .token = 11};
  store.begin_attempt(*store.job(job), first, "w", "log");
  EXPECT_THROW(store.begin_attempt(*store.job(job), first, "w", "log"), Error);
  EXPECT_TRUE(store.attempt(first).has_value());
  EXPECT_FALSE(store.attempt({.job_id = job.value, .number = first.number, .token = 99}).has_value());
}

TEST_F(StoreTest, SourceHashIsKnownForTheFileAsItWasOnly) {
  const auto file = folder.path() / "footage.mp4";
  write_file_atomically(file, "one");
  const FileStamp stamp = Store::stamp_of(file);
  EXPECT_EQ(store.known_source_hash(file, stamp), "");
  store.set_source_hash(file, stamp, "hash of one");
  EXPECT_EQ(store.known_source_hash(file, stamp), "hash of one");
  write_file_atomically(file, "other");
  EXPECT_EQ(store.known_source_hash(file, Store::stamp_of(file)), "");
  std::filesystem::remove(file);
  EXPECT_THROW(Store::stamp_of(file), Error);
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
