#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "jobs/probe/selftest_checks.h"
#include "jobs/probe/selftest_job.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class SelfTest : public testing::Test {
 protected:
  std::string run(const std::filesystem::path& store, const std::vector<std::string>& kinds) {
    std::filesystem::create_directories(folder.path() / "scratch");
    JobContext context({.unit = selftest_unit("w", store, kinds, 1).unit,
                        .inputs = {},
                        .sources = {},
                        .out_dir = folder.path() / "out",
                        .scratch_dir = folder.path() / "scratch",
                        .cores = 1,
                        .on_progress = [](double, const std::string&) {}});
    try {
      SelfTestJob::run(context, {});
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::Transient);
      return e.what();
    }
    return "";
  }
  TemporaryFolder folder;
};

TEST_F(SelfTest, PassesHereAndLeavesNothingInTheStore) {
  const auto store = folder.path() / "store";
  EXPECT_EQ(run(store, {"ingest/1", "depth/3"}), "");
  EXPECT_TRUE(std::filesystem::is_empty(store / ".tmp"));
}

TEST_F(SelfTest, NamesTheStoreThatCannotBeWritten) {
  write_file_atomically(folder.path() / "store", "a file where the folder should be");
  EXPECT_THAT(run(folder.path() / "store", {}), AllOf(HasSubstr("self-test failed: disk: "), Not(HasSubstr("exr"))));
}

TEST_F(SelfTest, MissingProgramFailsOnlyWhatOffersToUseIt) {
  const std::string path = getenv("PATH");
  setenv("PATH", "/nonexistent", 1);
  const std::string offers = run(folder.path() / "store", {"calibrate/1", "encode/1"});
  const std::string does_not = run(folder.path() / "store", {"depth/1"});
  setenv("PATH", path.c_str(), 1);
  EXPECT_THAT(offers, AllOf(HasSubstr("film: "), HasSubstr("colmap: "))) << "every failing check is named";
  EXPECT_EQ(does_not, "");
}

}  // namespace
}  // namespace vantage
