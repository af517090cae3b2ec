/// Databases of every version that was ever in use are opened, and nothing in them is lost.
#include <gtest/gtest.h>

#include "scheduler/store/migrations.h"
#include "scheduler/store/snapshot_files.h"
#include "scheduler/store/store.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

/// Written by the first version; what comes after is brought forward from it.
constexpr const char* kData = R"(
  INSERT INTO meta VALUES ('farm_id', 'f00d'), ('epoch', '41');
  INSERT INTO shot (id, folder, name, priority, state, generation, submitted_ms)
    VALUES (3, '/shots/dance', 'dance', 5, 'running', 2, 1000);
  INSERT INTO job (id, shot_id, name, kind, stage, version, generation, plan_hash, params, unit, sources, links, key,
                   content, state, priority, num_unmet, cores, ram_mb, timeout_s, num_attempts, num_crashes, created_ms)
    VALUES (10, 3, 'ingest/a', 'ingest', 0, 1, 2, 'p1', '{"x": 1}', '{}', '[]', '[]', 'k1', 'c1', 'done', 5, 0, 1, 500, 60, 1, 0, 1000),
           (11, 3, 'depth/1', 'depth', 7, 2, 2, 'p2', '{}', '{}', '[]', '[]', 'k2', '', 'ready', 5, 0, 2, 900, 60, 0, 0, 1000),
           (12, 3, 'depth/2', 'depth', 7, 2, 2, 'p3', '{}', '{}', '[]', '[]', 'k3', '', 'running', 5, 0, 2, 900, 60, 2, 1, 1000),
           (13, 3, 'render/1', 'render', 8, 1, 2, 'p4', '{}', '{}', '[]', '[]', '', '', 'blocked', 5, 2, 1, 400, 60, 0, 0, 1000),
           (14, 3, 'render/2', 'render', 8, 1, 1, 'p5', '{}', '{}', '[]', '[]', '', '', 'aborted', 5, 0, 1, 400, 60, 0, 0, 1000);
  INSERT INTO dependency VALUES (11, 10), (12, 10), (13, 11), (13, 12);
  INSERT INTO worker (id, incarnation, host, slots, cores, ram_mb, state, last_seen_ms)
    VALUES ('w1', 99, 'studio', 2, 4, 8000, 'active', 2000);
  INSERT INTO attempt (job_id, number, token, worker_id, key, state, outcome, log_path, leased_ms)
    VALUES (10, 1, 7, 'w1', 'k1', 'ended', 'done', '/l/1', 1500), (12, 1, 8, 'w1', 'k3', 'ended', 'crashed', '/l/2', 1600),
           (12, 2, 9, 'w1', 'k3', 'running', '', '/l/3', 1700);
  INSERT INTO event (at_ms, shot_id, job_id, kind, text) VALUES (1500, 3, 10, 'state', 'done');
  INSERT INTO source_hash VALUES ('/f/a.mp4', 100, 5, 6, 'h1');
)";

class OldVersion : public testing::TestWithParam<int> {
 protected:
  OldVersion() {
    Sqlite db(file(), Sqlite::Mode::ReadWrite);
    const auto& all = all_migrations();
    migrate(db, {all.front()});
    db.script(kData);
    migrate(db, {all.begin(), all.begin() + GetParam()});
  }
  fs::path file() const { return folder_.path() / "farm.sqlite"; }
  TemporaryFolder folder_;
};

TEST_P(OldVersion, OpensWithAllThatWasInIt) {
  Store store(file(), system_clock());
  EXPECT_EQ(store.db().integer_or(0, "PRAGMA user_version"), all_migrations().back().version);
  EXPECT_EQ(store.db().text_or("", "PRAGMA integrity_check"), "ok");
  EXPECT_FALSE(store.db().query("PRAGMA foreign_key_check").step());
  EXPECT_EQ(store.meta("epoch"), "41");
  const ShotRow shot = store.shot({3}).value();
  EXPECT_EQ(shot.folder, "/shots/dance");
  EXPECT_EQ(shot.priority, 5);
  const JobRow done = store.job({10}).value();
  EXPECT_EQ(done.content, "c1");
  EXPECT_EQ(done.params, "{\"x\": 1}");
  EXPECT_EQ(store.job({11})->state, JobState::Ready);
  EXPECT_EQ(store.job({12})->num_crashes, 1);
  EXPECT_EQ(store.job({13})->num_unmet, 2);
  const auto open = store.open_attempts();
  ASSERT_EQ(open.size(), 1U);
  EXPECT_EQ(open[0].ref.token, 9);
  EXPECT_EQ(open[0].worker_id, "w1");
  EXPECT_EQ(store.db().integer_or(0, "SELECT count(*) FROM attempt"), 3);
  EXPECT_EQ(store.db().text_or("", "SELECT text FROM event WHERE job_id = 10"), "done");
  EXPECT_EQ(store.db().text_or("", "SELECT hash FROM source_hash"), "h1");
  EXPECT_EQ(store.worker_state("w1"), "active");
}

/// The counts and classes of later versions must fit the rows of earlier ones: a job that waits is claimed.
TEST_P(OldVersion, GoesOnWorking) {
  Store store(file(), system_clock());
  store.begin();
  store.move({12}, JobState::Reconnect, "");
  store.move({12}, JobState::Running, "");
  store.move({11}, JobState::Leased, "");
  store.move({11}, JobState::Running, "");
  store.move({11}, JobState::Done, "");
  store.commit();
  EXPECT_EQ(store.job({13})->num_unmet, 1);
  EXPECT_TRUE(store.has_planned_unfinished({3}));
}

TEST_P(OldVersion, IsKeptBesideAsItWas) {
  Store store(file(), system_clock());
  Sqlite copy(snapshot_before_version(file(), all_migrations().back().version), Sqlite::Mode::ReadOnly);
  EXPECT_EQ(copy.integer_or(0, "PRAGMA user_version"), GetParam());
  EXPECT_EQ(copy.integer_or(0, "SELECT count(*) FROM job"), 5);
  EXPECT_EQ(copy.why_damaged(), "");
}

/// Of the newest there is nothing to migrate; with a single version the first stands for itself.
INSTANTIATE_TEST_SUITE_P(Versions, OldVersion, testing::Range(1, std::max(2, all_migrations().back().version)));

}  // namespace
}  // namespace vantage
