#include "scheduler/estimate/shot_estimate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/fake_farm.h"

namespace vantage {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class ShotEstimateTest : public testing::Test {
 protected:
  /// Every job takes 5 s. Until so many correspond jobs are done.
  void run_until_edges_done(int num) {
    for (int round = 0; round < 100; ++round) {
      farm.clock.now_ms += 100;
      farm.sync(worker);
      if (farm.store->db().integer_or(0, "SELECT count(*) FROM job WHERE kind = 'correspond' AND state = 'done'") >=
          num)
        return;
      if (!worker.held().empty()) worker.finish(worker.held().begin()->first);
    }
    FAIL();
  }
  std::optional<ShotEstimate> estimate() {
    return estimate_shot(farm.store->db(), farm.shot, kind_names(farm.kinds), farm.clock.wall_ms());
  }
  void submit_second_shot() {
    const auto folder = farm.shot_folder().parent_path() / "second";
    std::filesystem::create_directories(folder);
    std::filesystem::copy(farm.shot_folder() / "shot.toml", folder / "shot.toml");
    for (const char* footage : {"a.mp4", "b.mp4"}) write_file_atomically(folder / footage, footage);
    farm.turn([&] { farm.shot = farm.planner->submit(folder, "", 0).shot.id; });
  }
  FakeFarm farm;
  FakeWorker worker{"w", 2};
};

TEST_F(ShotEstimateTest, SaysWhyNothingCanBeToldAtTheStart) {
  farm.submit();
  EXPECT_EQ(estimate()->why, "no worker takes work");
  farm.sync(worker);
  farm.sync(worker);
  EXPECT_EQ(estimate()->why, "no job of what is left has been timed yet");
}

TEST_F(ShotEstimateTest, ComesFromTheShotsOwnDurations) {
  farm.num_edges = 22;
  farm.submit();
  run_until_edges_done(2);
  const auto e = estimate();
  ASSERT_TRUE(e && e->rest);
  EXPECT_NEAR(e->rest->middle_s, 50, 25);  // 20 of 5 s on two slots
  EXPECT_LT(e->rest->low_s, e->rest->high_s);
  EXPECT_THAT(e->rest->unknown_kinds, ElementsAre("encode"));
}

TEST_F(ShotEstimateTest, CriticalPathIsTheChainThatEndsLast) {
  farm.submit();
  run_until_edges_done(1);
  const auto e = estimate();
  ASSERT_EQ(e->critical_path.size(), 2U);
  EXPECT_EQ(e->critical_path.back().name, "encode");
  EXPECT_NEAR(e->critical_path_s, 5, 3);
}

TEST_F(ShotEstimateTest, EarlierShotsTellOfStagesThatAreNotPlannedYet) {
  farm.num_edges = 10;
  farm.submit();
  farm.run_to_end(worker);
  EXPECT_FALSE(estimate()) << "has ended";
  submit_second_shot();
  farm.sync(worker);
  const auto e = estimate();
  ASSERT_TRUE(e && e->rest);
  EXPECT_THAT(e->rest->unknown_kinds, IsEmpty());
  // 2 ingest, calibrate, navspace, 10 correspond, encode, each of 5 s, on two slots: 5 + 5 + 5 + 25 + 5.
  EXPECT_NEAR(e->rest->middle_s, 45, 20);
}

}  // namespace
}  // namespace vantage
