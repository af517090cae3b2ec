#include "worker/log_limit.h"

#include <gtest/gtest.h>

#include <fstream>

#include "schema/base/files.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

struct LogLimitTest : ::testing::Test {
  TemporaryFolder folder;
  std::filesystem::path file = folder.path() / "1.log";
  LogLimit limit{file, {.head_bytes = 100, .tail_bytes = 200}};
  int next_line = 0;

  void append(int num_lines) {
    std::ofstream out(file, std::ios::app);
    for (int i = 0; i < num_lines; ++i) out << "line " << 1000 + next_line++ << '\n';  // 10 bytes each
  }
};

TEST_F(LogLimitTest, OrdinaryLogIsLeftAlone) {
  limit.enforce();
  append(60);
  limit.enforce();
  EXPECT_EQ(std::filesystem::file_size(file), 600U);
  EXPECT_EQ(limit.num_cut_bytes(), 0);
}

TEST_F(LogLimitTest, BeginningAndEndStayAndTheCutIsTold) {
  append(100);
  limit.enforce();
  append(100);
  limit.enforce();
  const std::string text = read_file(file);
  EXPECT_TRUE(text.starts_with("line 1000\n")) << text;
  EXPECT_TRUE(text.ends_with("line 1198\nline 1199\n")) << text;
  EXPECT_LT(text.size(), 400U);
  EXPECT_NE(text.find("[… " + std::to_string(limit.num_cut_bytes()) + " bytes of log were cut out here …]"),
            std::string::npos)
      << text;
  EXPECT_EQ(limit.num_cut_bytes(), 2000 - 100 - 190) << "all that was written but what is kept";
  EXPECT_EQ(text.find("cut out", text.find("cut out") + 1), std::string::npos) << "one line says it all";
}

}  // namespace
}  // namespace vantage
