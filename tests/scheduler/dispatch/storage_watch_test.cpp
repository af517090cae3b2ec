#include "scheduler/dispatch/storage_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

TEST(StorageWatch, SaysWhatIsWrongAndLooksAgainAfterAWhile) {
  const TemporaryFolder folder;
  const fs::path shot = folder.path() / "shot";
  fs::create_directories(shot);
  StorageWatch watch([&](ShotId) { return shot; });
  const ShotId id{1};
  EXPECT_EQ(watch.trouble(id, 0), "");
  fs::remove(shot);
  EXPECT_EQ(watch.trouble(id, 1000), "") << "not asked for each job";
  EXPECT_THAT(watch.look(id, 1000), HasSubstr("shot: cannot be reached: No such file"));
  fs::create_directories(shot);
  EXPECT_NE(watch.trouble(id, 2000), "");
  EXPECT_EQ(watch.trouble(id, 3000), "") << "well again";
}

}  // namespace
}  // namespace vantage
