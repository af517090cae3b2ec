#include "scheduler/dispatch/why_waiting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/fake_farm.h"

namespace vantage {
namespace {

using testing::HasSubstr;

class WhyWaitingTest : public testing::Test {
 protected:
  void submit_with(const std::string& more) {
    write_file_atomically(farm.shot_folder() / "shot.toml",
                          "[shot]\nname = \"fake\"\n[[camera]]\nname = \"a\"\nfootage = \"a.mp4\"\n"
                          "[[camera]]\nname = \"b\"\nfootage = \"b.mp4\"\n" +
                              more);
    farm.submit();
  }
  std::string why(const std::string& job) {
    return why_waiting(farm.store->db(), farm.job(job).id, farm.clock.wall_ms());
  }
  FakeFarm farm;
  FakeWorker worker{"w", 1};
};

TEST_F(WhyWaitingTest, NamesPoolAndTagsAndWhatBecameOfThatPool) {
  submit_with("[farm]\npool = \"night\"\ntags = [\"bigmem\"]\n");
  EXPECT_EQ(why("ingest/a"),
            "waits for a worker of pool 'night' with tag 'bigmem' that can run ingest/1: no worker has ever reported");
  farm.sync(worker);
  farm.sync(worker);
  EXPECT_THAT(why("ingest/a"), HasSubstr("no worker is of that pool"));
  worker.machine().pool = "night";
  farm.sync(worker);
  EXPECT_THAT(why("ingest/a"), HasSubstr("none of that pool fits (1 active)"));
  farm.command({.verb = Command::Verb::Drain, .worker = "w"});
  worker.machine().tags = {"bigmem"};
  farm.sync(worker);
  EXPECT_THAT(why("ingest/a"), HasSubstr("none takes work (1 draining)"));
}

TEST_F(WhyWaitingTest, SaysWhenOnlyRoomIsMissing) {
  submit_with("");
  farm.sync(worker);
  farm.sync(worker);
  EXPECT_EQ(why("ingest/a"), "") << "is at work";
  EXPECT_EQ(why("ingest/b"), "waits for a free slot: 1 worker can take it");
  farm.command({.verb = Command::Verb::Pause, .shot = farm.shot});
  EXPECT_EQ(why("ingest/b"), "waits: fake is paused");
}

}  // namespace
}  // namespace vantage
