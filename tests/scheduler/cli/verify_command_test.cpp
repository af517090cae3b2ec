// `vantage verify` and `vantage gc` on a shot that was really run, as far as its footage.
#include <gtest/gtest.h>

#include <fstream>

#include "schema/base/files.h"
#include "schema/base/json.h"
#include "schema/base/program.h"
#include "tests/scheduler/cli/vantage_program.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

class ShotThatRan : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(shot());
    for (const char* name : {"a", "b"})
      ASSERT_EQ(run_program({"ffmpeg", "-v", "error", "-f", "lavfi", "-i", "testsrc=size=96x64:rate=10:duration=0.5",
                             (shot() / name).string() + ".mp4"},
                            {.stdout_file = {}, .stderr_file = {}}),
                0);
    write_file_atomically(shot() / "shot.toml",
                          "[[camera]]\nname = \"a\"\nfootage = \"a.mp4\"\n[[camera]]\nname = \"b\"\nfootage = "
                          "\"b.mp4\"\n");
    const Ended ended = run();
    ASSERT_EQ(ended.exit_code, 0) << ended.output;
  }
  Ended run() { return vantage("run " + shot().string() + " --until ingest --no-http --workers 1 --json"); }
  Ended verify(const std::string& options = "") { return vantage("verify " + shot().string() + " " + options); }
  fs::path shot() const { return folder_.path() / "shot"; }
  /// The largest file of the first artifact.
  fs::path some_result() const {
    fs::path largest;
    for (const auto& entry :
         fs::recursive_directory_iterator(fs::directory_iterator(shot() / ".vantage/store/ingest")->path()))
      if (entry.is_regular_file() && entry.path().filename() != "manifest.json" &&
          (largest.empty() || entry.file_size() > fs::file_size(largest)))
        largest = entry.path();
    return largest;
  }
  TemporaryFolder folder_;
};

TEST_F(ShotThatRan, IsReadRecomputedAndFoundTheSame) {
  const Ended ended = verify("--all --json");
  ASSERT_EQ(ended.exit_code, 0) << ended.output;
  const Json report = Json::parse(ended.output);
  EXPECT_EQ(report.at("num_read"), 2);
  ASSERT_EQ(report.at("rows").size(), 2U);
  for (const Json& row : report.at("rows")) EXPECT_EQ(row.at("verdict"), "same") << row.dump();
  for (const auto& entry : fs::directory_iterator(shot() / ".vantage"))
    EXPECT_FALSE(entry.path().filename().string().starts_with("verify.")) << "the second store is removed";
}

TEST_F(ShotThatRan, AFlippedBitIsFoundNamedAndMended) {
  const fs::path file = some_result();
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekg(20);
  const int byte = stream.get();
  stream.seekp(20);
  stream.put(static_cast<char>(byte ^ 1));
  stream.close();

  const Ended found = verify();
  EXPECT_EQ(found.exit_code, 1);
  EXPECT_NE(found.output.find(file.filename().string()), std::string::npos) << found.output;
  EXPECT_NE(found.output.find("has hash"), std::string::npos) << found.output;
  EXPECT_NE(found.output.find("--repair"), std::string::npos) << found.output;
  EXPECT_EQ(verify("--repair").exit_code, 1);
  EXPECT_FALSE(fs::exists(file));
  EXPECT_EQ(run().exit_code, 0);
  EXPECT_EQ(verify().exit_code, 0);
}

TEST_F(ShotThatRan, HasNoGarbageButTheResultsOfAnEditThatWasTakenBack) {
  Json list = Json::parse(vantage("gc " + shot().string() + " --keep-days 0 --json").output);
  for (const Json& item : list.at("items")) EXPECT_NE(item.at("what"), "artifact") << item.dump();
  ASSERT_EQ(run_program({"ffmpeg", "-y", "-v", "error", "-f", "lavfi", "-i", "testsrc2=size=96x64:rate=10:duration=0.5",
                         (shot() / "b.mp4").string()},
                        {.stdout_file = {}, .stderr_file = {}}),
            0);
  ASSERT_EQ(run().exit_code, 0);
  const Ended removed = vantage("gc " + shot().string() + " --keep-days 0 --delete --json");
  ASSERT_EQ(removed.exit_code, 0) << removed.output;
  int num_artifacts = 0;
  list = Json::parse(removed.output);
  for (const Json& item : list.at("items")) num_artifacts += item.at("what") == "artifact";
  EXPECT_EQ(num_artifacts, 1);
  EXPECT_EQ(verify().exit_code, 0) << "what the present plan needs is all there";
}

}  // namespace
}  // namespace vantage
