#include "schema/base/files.h"

#include <gtest/gtest.h>

#include "schema/base/error.h"
#include "schema/base/json.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

TEST(Files, AtomicWriteReplacesTheWholeFileAndLeavesNoTemporary) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "a.txt";
  write_file_atomically(file, "first and long");
  write_file_atomically(file, "second");
  EXPECT_EQ(read_file(file), "second");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
}

TEST(Files, MissingFileIsNamedInTheError) {
  try {
    read_file("/nowhere/x.txt");
    FAIL() << "expected an error";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::Transient);
    EXPECT_NE(std::string(e.what()).find("/nowhere/x.txt"), std::string::npos);
  }
}

TEST(Files, UnwritableFolderIsAnErrorAndNotSilence) {
  EXPECT_THROW(write_file_atomically("/proc/self/vantage-test", "text"), Error);
}

TEST(Files, SymlinkIsReplacedInOneStep) {
  const TemporaryFolder folder;
  const fs::path link = folder.path() / "link";
  replace_symlink("one", link);
  replace_symlink("two", link);
  EXPECT_EQ(fs::read_symlink(link), "two");
}

TEST(Json, BrokenTextIsBadInputThatNamesTheFile) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "broken.json";
  write_file_atomically(file, "{\"a\": ");
  try {
    read_json(file);
    FAIL() << "expected an error";
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::BadInput);
    EXPECT_NE(std::string(e.what()).find("broken.json"), std::string::npos);
  }
}

}  // namespace
}  // namespace vantage
