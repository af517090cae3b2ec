#include "schema/base/log_file.h"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

TEST(LogFile, StartsANewOneWhenItIsFullAndKeepsTheLast) {
  const TemporaryFolder folder;
  const auto sinks_before = spdlog::default_logger()->sinks();
  spdlog::default_logger()->sinks().clear();  // 4 MB on the screen help nobody
  also_log_to(folder.path() / "worker.log", 1, 2);
  for (int i = 0; i < 4000; ++i) spdlog::info("{} {}", i, std::string(1000, 'x'));
  spdlog::default_logger()->sinks() = sinks_before;
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator{}), 3);
  for (const char* name : {"worker.log", "worker.1.log", "worker.2.log"})
    EXPECT_LE(fs::file_size(folder.path() / name), 1'000'000U) << name;
}

}  // namespace
}  // namespace vantage
