/// The whole pipeline on a small shot with known cameras and clocks: every output there, and only what an edit reaches
/// done again.
#include <gtest/gtest.h>

#include "schema/base/files.h"
#include "schema/base/json.h"
#include "tests/e2e/farm_under_test.h"
#include "tests/support/temporary_folder.h"

namespace vantage::e2e {
namespace {
namespace fs = std::filesystem;

const std::string kBin = VANTAGE_BIN;

class Pipeline : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    shot_ = folder_->path() / "shot";
    const Ended made = run({kBin + "/vantage-demo-shot", shot_, "--known", "--cameras", "3", "--frames", "5", "--width",
                            "160", "--height", "90"});
    ASSERT_EQ(made.exit_code, 0) << made.output;
    const Ended ended = run_shot();
    ASSERT_EQ(ended.exit_code, 0) << ended.output;
  }
  static void TearDownTestSuite() { delete folder_; }
  static Ended run_shot() { return run({kBin + "/vantage", "run", shot_, "--workers", "2"}); }
  static fs::path out(const std::string& relative) { return shot_ / "out" / relative; }

  static inline TemporaryFolder* folder_ = nullptr;
  static inline fs::path shot_;
};

TEST_F(Pipeline, EveryOutputIsThere) {
  for (const char* file : {"calibration/cameras.txt", "calibration/images.txt", "calibration/points3D.txt",
                           "clocks.json", "navspace.json", "depth/cam1/000002.exr", "model/patches.ply",
                           "model/surface.ply", "render/freeze/frame.000000.exr", "render/freeze/frame.000000.png",
                           "render/freeze/freeze.mp4", "render/stereo/stereo.mp4", "render/stereo/side_by_side.mp4",
                           "render/stereo/anaglyph.mp4", "render/stereo_depth/frame.000000.exr", "report.html"})
    EXPECT_TRUE(fs::is_regular_file(out(file)) && fs::file_size(out(file)) > 0) << file;
  EXPECT_EQ(fs::canonical(out("render/stereo/side_by_side.mp4")), fs::canonical(out("render/stereo/stereo.mp4")));
  const Json navspace = read_json(out("navspace.json"));
  std::size_t num_flows = 0;
  for (const auto& entry : fs::directory_iterator(out("flow"))) num_flows += entry.is_regular_file() ? 1 : 0;
  EXPECT_EQ(num_flows, 2 * navspace.at("edges").size()) << "a map each way for every edge";
}

TEST_F(Pipeline, RunningAgainDoesNothing) {
  const int before = num_attempts(shot_);
  const Ended again = run_shot();
  EXPECT_EQ(again.exit_code, 0) << again.output;
  EXPECT_EQ(num_attempts(shot_), before);
}

TEST_F(Pipeline, TouchedFootageIsNotDoneAgain) {
  const int before = num_attempts(shot_);
  fs::last_write_time(shot_ / "footage/cam0.mp4", fs::file_time_type::clock::now());
  const Ended again = run_shot();
  EXPECT_EQ(again.exit_code, 0) << again.output;
  EXPECT_EQ(num_attempts(shot_), before);
}

TEST_F(Pipeline, AChangedKeyFrameRendersAndEncodesOnly) {
  const int before = num_attempts(shot_);
  edit(shot_ / "shot.toml", "at_s = 1.000, ", "at_s = 1.100, ");
  const Ended again = run_shot();
  EXPECT_EQ(again.exit_code, 0) << again.output;
  EXPECT_EQ(kinds_attempted_after(shot_, before), (std::vector<std::string>{"encode", "render"}));
}

TEST_F(Pipeline, ADamagedArtifactIsFoundAndMadeAgain) {
  const fs::path depth = fs::canonical(out("depth/cam1/000002.exr"));
  const auto whole = fs::file_size(depth);
  fs::resize_file(depth, whole / 2);
  const int before = num_attempts(shot_);
  const Ended again = run_shot();
  EXPECT_EQ(again.exit_code, 0) << again.output;
  EXPECT_EQ(kinds_attempted_after(shot_, before), (std::vector<std::string>{"depth"}));
  EXPECT_EQ(fs::file_size(out("depth/cam1/000002.exr")), whole);
}

TEST_F(Pipeline, StatusJobsWhyAndLogsAnswerAfterwards) {
  const Ended status = run({kBin + "/vantage", "status", shot_});
  EXPECT_EQ(status.exit_code, 0);
  EXPECT_NE(status.output.find("correspond"), std::string::npos) << status.output;
  const Ended jobs = run({kBin + "/vantage", "jobs", shot_, "--json"});
  EXPECT_EQ(jobs.exit_code, 0);
  EXPECT_TRUE(Json::accept(jobs.output)) << jobs.output;
  const Ended why = run({kBin + "/vantage", "why", shot_, "navspace"});
  EXPECT_EQ(why.exit_code, 0) << why.output;
  EXPECT_FALSE(why.output.empty());
  EXPECT_EQ(run({kBin + "/vantage", "logs", shot_, "navspace"}).exit_code, 0);
  EXPECT_EQ(run({kBin + "/vantage", "logs", shot_, "no/such/job"}).exit_code, 2);
}

}  // namespace
}  // namespace vantage::e2e
