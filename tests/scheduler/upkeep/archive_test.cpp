#include "scheduler/upkeep/archive.h"

#include <gtest/gtest.h>

#include "scheduler/publish/publisher.h"
#include "schema/base/error.h"
#include "schema/base/program.h"
#include "tests/support/fake_farm.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

class Archive : public testing::Test {
 protected:
  void SetUp() override {
    if (run_program({"zstd", "--version"}, {.stdout_file = other_.path() / "x", .stderr_file = {}}) != 0)
      GTEST_SKIP() << "zstd is not installed";
  }
  void run() {
    farm_.submit();
    farm_.run_to_end(worker_);
    publish_shot(*farm_.store, farm_.shot, /*sweep=*/true);
  }
  fs::path state_dir() const { return farm_.database().parent_path(); }
  fs::path file() const { return other_.path() / "dance.tar.zst"; }
  FakeFarm farm_;
  FakeWorker worker_{"w", 4};
  TemporaryFolder other_;
};

TEST_F(Archive, ComesBackWithEveryResultAndIsFoundByItsKeys) {
  run();
  const std::string result = read_file(farm_.shot_folder() / "out/flow/0.json");
  const ArchiveFacts packed = pack_shot(farm_.shot_folder(), state_dir(), file());
  EXPECT_EQ(packed.num_artifacts, packed.num_jobs);
  EXPECT_EQ(fs::file_size(file()), packed.num_bytes);
  EXPECT_EQ(std::distance(fs::directory_iterator(other_.path()), fs::directory_iterator{}), 2) << "no left-overs";

  remove_archived(farm_.shot_folder());
  EXPECT_FALSE(fs::exists(farm_.shot_folder() / ".vantage/store"));
  EXPECT_FALSE(fs::exists(fs::symlink_status(farm_.shot_folder() / "out/flow/0.json"))) << "a link to nothing";

  const fs::path back = other_.path() / "back";
  EXPECT_EQ(unpack_shot(file(), back).num_artifacts, packed.num_artifacts);
  EXPECT_FALSE(fs::is_symlink(back / "out/flow/0.json"));
  EXPECT_EQ(read_file(back / "out/flow/0.json"), result);
  fs::rename(back / ".vantage/store", farm_.shot_folder() / ".vantage/store");
  FakeWorker idle("idle", 4);
  farm_.submit();
  farm_.run_to_end(idle);
  EXPECT_TRUE(idle.num_runs.empty()) << "nothing is computed again";
}

TEST_F(Archive, RefusesAShotThatIsNotDoneOrDamaged) {
  farm_.submit();
  EXPECT_THROW(pack_shot(farm_.shot_folder(), state_dir(), file()), Error);
  farm_.run_to_end(worker_);
  write_file_atomically(farm_.shot_folder() / ".vantage/store/encode" / farm_.job("encode").key / "out.json", "{}");
  try {
    pack_shot(farm_.shot_folder(), state_dir(), file());
    FAIL() << "packed a damaged result";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("encode: out.json"), std::string::npos) << e.what();
  }
  EXPECT_FALSE(fs::exists(file()));
}

TEST_F(Archive, ADamagedFileIsNotUnpacked) {
  run();
  pack_shot(farm_.shot_folder(), state_dir(), file());
  fs::resize_file(file(), fs::file_size(file()) - 20);
  EXPECT_THROW(unpack_shot(file(), other_.path() / "back"), Error);
  EXPECT_FALSE(fs::exists(other_.path() / "back"));
}

TEST_F(Archive, KeepsAStoreThatIsShared) {
  run();
  fs::rename(farm_.shot_folder() / ".vantage/store", other_.path() / "store");
  fs::create_directory_symlink(other_.path() / "store", farm_.shot_folder() / ".vantage/store");
  EXPECT_THROW(remove_archived(farm_.shot_folder()), Error);
  EXPECT_TRUE(fs::exists(other_.path() / "store/encode"));
}

}  // namespace
}  // namespace vantage
