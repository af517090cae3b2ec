#include "scheduler/publish/publisher.h"

#include <gtest/gtest.h>

#include "tests/support/fake_farm.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

class PublisherTest : public testing::Test {
 protected:
  void SetUp() override {
    farm.submit();
    farm.run_to_end(worker);
    publish_shot(*farm.store, farm.shot, /*sweep=*/true);
  }
  fs::path out() const { return farm.shot_folder() / "out"; }

  FakeFarm farm;
  FakeWorker worker{"w", 2};
};

TEST_F(PublisherTest, FileAndFolderLinksLeadIntoTheStoreRelatively) {
  EXPECT_TRUE(fs::is_symlink(out() / "flow/0.json"));
  EXPECT_TRUE(fs::read_symlink(out() / "flow/0.json").is_relative());
  EXPECT_EQ(read_json(out() / "flow/0.json").at("job"), "correspond/0");
  EXPECT_EQ(read_json(out() / "calibration/out.json").at("job"), "calibrate");
  EXPECT_FALSE(fs::exists(out() / "calibration/manifest.json"));
}

TEST_F(PublisherTest, LinksStillLeadSomewhereWhenTheShotIsMoved) {
  const fs::path moved = farm.shot_folder().parent_path() / "moved";
  fs::rename(farm.shot_folder(), moved);
  EXPECT_EQ(read_json(moved / "out/flow/1.json").at("job"), "correspond/1");
}

TEST_F(PublisherTest, RerunPointsToTheNewResult) {
  const auto before = fs::read_symlink(out() / "calibration/out.json");
  farm.sigma = 5;
  farm.submit();
  farm.run_to_end(worker);
  EXPECT_TRUE(publish_job(farm.shot_folder(), farm.job("calibrate")).empty());
  EXPECT_NE(fs::read_symlink(out() / "calibration/out.json"), before);
  EXPECT_EQ(read_json(out() / "calibration/out.json").at("params").at("sigma"), 5);
}

TEST_F(PublisherTest, SweepRemovesOnlyOurLinksThatNobodyOwns) {
  write_file_atomically(out() / "flow/notes.txt", "mine");
  fs::create_symlink("/etc/hostname", out() / "flow/own_link");
  farm.num_edges = 1;
  farm.submit();
  farm.run_to_end(worker);
  publish_shot(*farm.store, farm.shot, /*sweep=*/true);
  EXPECT_TRUE(fs::exists(out() / "flow/0.json"));
  EXPECT_FALSE(fs::is_symlink(out() / "flow/1.json"));
  EXPECT_EQ(read_file(out() / "flow/notes.txt"), "mine");
  EXPECT_TRUE(fs::is_symlink(out() / "flow/own_link"));
}

TEST_F(PublisherTest, APersonsFileInTheWayStays) {
  fs::remove(out() / "flow/0.json");
  write_file_atomically(out() / "flow/0.json", "mine");
  const auto in_the_way = publish_job(farm.shot_folder(), farm.job("correspond/0"));
  ASSERT_EQ(in_the_way.size(), 1U);
  EXPECT_EQ(in_the_way.front(), out() / "flow/0.json");
  EXPECT_EQ(read_file(out() / "flow/0.json"), "mine");
}

}  // namespace
}  // namespace vantage
