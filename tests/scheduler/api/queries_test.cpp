#include "scheduler/api/queries.h"

#include <gtest/gtest.h>

#include "scheduler/api/route_table.h"
#include "tests/scheduler/api/small_farm.h"

namespace vantage {
namespace {

class Queries : public testing::Test {
 protected:
  SmallFarm farm_;
  FarmQueries queries_{farm_.state_dir()};
};

TEST_F(Queries, StagesStandInTheOrderOfThePipelineAndCountStates) {
  const Json shot = queries_.shot(SmallFarm::kShotId);
  ASSERT_EQ(shot.at("stages").size(), 12u);
  EXPECT_EQ(shot.at("stages").front().at("kind"), "ingest");
  EXPECT_EQ(shot.at("stages").front().at("counts"), (Json{{"done", 1}, {"skipped", 1}}));
  EXPECT_EQ(shot.at("counts").at("blocked"), 6);
  EXPECT_EQ(shot.at("films").at(0).at("path"), "render/freeze/freeze.mp4");
}

TEST_F(Queries, JobsOfAReplacedPlanAreNotShown) { EXPECT_EQ(queries_.jobs(1, {.kind = "depth"}).at("total"), 1); }

TEST_F(Queries, WhatRunsComesFirstThenWhatFailed) {
  const Json jobs = queries_.jobs(1, {}).at("jobs");
  EXPECT_EQ(jobs.at(0).at("id"), SmallFarm::kRunningId);
  EXPECT_EQ(jobs.at(1).at("id"), SmallFarm::kFailedId);
}

TEST_F(Queries, FiltersByStatesAndByPartOfTheName) {
  EXPECT_EQ(queries_.jobs(1, {.states = "done,skipped"}).at("total"), 6);
  EXPECT_EQ(queries_.jobs(1, {.states = "done,skipped"}).at("jobs").size(), 6u);
  EXPECT_EQ(queries_.jobs(1, {.states = "don"}).at("total"), 0);
  EXPECT_EQ(queries_.jobs(1, {.text = "FREEZE"}).at("jobs").size(), 6u);
  EXPECT_EQ(queries_.jobs(1, {.kind = "encode", .text = "FREEZE"}).at("jobs").size(), 0u);
  EXPECT_EQ(queries_.jobs(1, {.name = "calibrate"}).at("jobs").at(0).at("kind"), "calibrate");
  EXPECT_EQ(queries_.jobs(1, {.name = "depth/old"}).at("jobs").size(), 0u) << "of a replaced plan";
}

/// All pages of a list, one after the other.
std::vector<std::int64_t> all_ids(FarmQueries& queries, JobFilter filter) {
  std::vector<std::int64_t> ids;
  for (;;) {
    const Json page = queries.jobs(1, filter);
    for (const auto& job : page.at("jobs")) ids.push_back(job.at("id"));
    if (page.at("after").is_null()) return ids;
    filter.after = page.at("after");
  }
}

TEST_F(Queries, PagesJoinToTheWholeList) {
  for (const char* text : {"", "e"}) {
    const auto whole = all_ids(queries_, {.text = text, .limit = 1000});
    EXPECT_GE(whole.size(), 10u);
    for (const int limit : {1, 2, 3, 5, 7}) EXPECT_EQ(all_ids(queries_, {.text = text, .limit = limit}), whole);
  }
  EXPECT_EQ(all_ids(queries_, {.limit = 4}).size(), 14u);
  EXPECT_THROW(queries_.jobs(1, {.after = "9-1"}), Error);
  EXPECT_THROW(queries_.jobs(1, {.after = "x"}), Error);
}

TEST_F(Queries, AJobTellsItsAttemptsInputsFiguresAndHistory) {
  const Json failed = queries_.job(SmallFarm::kFailedId);
  ASSERT_EQ(failed.at("attempts").size(), 2u);
  EXPECT_EQ(failed.at("attempts").at(0).at("number"), 2);
  EXPECT_EQ(failed.at("history").at(0).at("text"), "ready: new");
  EXPECT_EQ(queries_.job(SmallFarm::kFlowId).at("figures").at("inliers"), 812);
  EXPECT_EQ(queries_.job(7).at("inputs").size(), 2u);
  EXPECT_TRUE(queries_.job(SmallFarm::kFlowId).at("has_preview"));
  EXPECT_FALSE(failed.at("has_preview"));
}

TEST_F(Queries, AWorkerTellsWhatItRuns) {
  const Json worker = queries_.workers().at("workers").at(0);
  EXPECT_EQ(worker.at("running").at(0).at("phase"), "backward flow");
}

TEST_F(Queries, UnknownThingsAreNotFoundAndNamesAreSuggested) {
  EXPECT_THROW(queries_.shot(9), NotFound);
  EXPECT_THROW(queries_.job(999), NotFound);
  try {
    queries_.job_by_name(1, "calibrat");
    FAIL() << "there is no such job";
  } catch (const NotFound& e) {
    EXPECT_NE(std::string(e.what()).find("did you mean 'calibrate'?"), std::string::npos) << e.what();
  }
}

TEST_F(Queries, DataVersionChangesWhenTheSchedulerWrites) {
  const auto before = queries_.data_version();
  EXPECT_EQ(queries_.data_version(), before);
  farm_.db().run("UPDATE job SET progress = 0.5 WHERE id = 5");
  EXPECT_NE(queries_.data_version(), before);
}

TEST_F(Queries, RoutesRejectBadNumbersAndUnknownPaths) {
  EXPECT_THROW(answer_from_database(queries_, "/shots/1/jobs", {{"limit", "many"}}), Error);
  EXPECT_THROW(answer_from_database(queries_, "/shot", {}), NotFound);
  EXPECT_EQ(answer_from_database(queries_, "/shots/1/jobs", {{"limit", "2"}}).at("jobs").size(), 2u);
}

}  // namespace
}  // namespace vantage
