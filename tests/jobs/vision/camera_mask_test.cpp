#include "jobs/vision/camera_mask.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "jobs/mask_sources.h"
#include "schema/base/error.h"
#include "schema/formats/footage_trim.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

class Mask : public testing::Test {
 protected:
  Mask() {
    shot_.folder = folder_.path();
    ShotCamera left;
    left.name = "left", left.line = 7;
    shot_.cameras = {left};
  }

  /// Columns from `from` on count.
  void write_mask(const std::string& name, int from, cv::Size size = {96, 64}) {
    cv::Mat1b mask(size, uchar{0});
    mask.colRange(from, size.width).setTo(255);
    cv::imwrite((folder_.path() / name).string(), mask);
  }
  CameraMask mask(int num_before = 0) {
    JobContext::Config config;
    config.inputs["ingest/left"] = folder_.path();
    if (num_before > 0) write_footage_trim(folder_.path() / "trim.json", {num_before, num_before / 30.0});
    for (const auto& source : mask_sources(shot_, shot_.cameras[0])) config.sources[source.name] = source.path;
    const JobContext context(config);
    return CameraMask(context, {.camera = "left", .width = 96, .height = 64, .fps = 30, .pts_s = {0, 0.03, 0.07}});
  }
  std::string error() {
    try {
      mask().at(0);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::BadInput);
      return e.what();
    }
    return "no error";
  }

  TemporaryFolder folder_;
  Shot shot_;
};

TEST_F(Mask, NoneMeansThatEverythingCounts) {
  EXPECT_FALSE(mask().exists());
  EXPECT_TRUE(mask().at(1).empty());
}

TEST_F(Mask, OneStillHoldsForAllFrames) {
  write_mask("m.png", 40);
  shot_.cameras[0].mask = "m.png";
  for (const int frame : {0, 2}) {
    EXPECT_EQ(mask().at(frame)(5, 39), 0);
    EXPECT_EQ(mask().at(frame)(5, 40), 255);
  }
}

TEST_F(Mask, SequenceCountsThePicturesOfTheWholeFootage) {
  for (int k = 0; k < 5; ++k) write_mask(fmt::format("m{}.png", k), 10 * k);
  shot_.cameras[0].mask = "m*.png";
  EXPECT_EQ(cv::countNonZero(mask().at(1)), 86 * 64);
  EXPECT_EQ(cv::countNonZero(mask(2).at(1)), 66 * 64);
  EXPECT_THROW(mask(2).at(3), Error);
}

TEST_F(Mask, PlateCountsWhereMostFramesDo) {
  for (int k = 0; k < 3; ++k) write_mask(fmt::format("m{}.png", k), 10 * k);
  shot_.cameras[0].mask = "m*.png";
  EXPECT_EQ(cv::countNonZero(mask().of_plate({0, 1, 2})), 86 * 64);
}

TEST_F(Mask, JobOfOneFrameReadsOneMask) {
  for (int k = 0; k < 3; ++k) write_mask(fmt::format("m{}.png", k), 10 * k);
  shot_.cameras[0].mask = "m*.png";
  write_footage_trim(folder_.path() / "trim.json", {1, 0.04});
  const ShotState state(shot_, [&](const std::string&) { return folder_.path(); });
  const auto sources = mask_sources(state, {"left", 1});
  ASSERT_EQ(sources.size(), 1U);
  EXPECT_EQ(sources[0].name, "mask/left/000002");
  EXPECT_EQ(sources[0].path, folder_.path() / "m2.png");
  EXPECT_THROW(mask_sources(state, {"left", 2}), Error);
}

TEST_F(Mask, ErrorsSayWhatIsWrong) {
  shot_.cameras[0].mask = "gone.png";
  EXPECT_EQ(error(), (folder_.path() / "shot.toml").string() +
                         ":7: camera 'left' has mask gone.png, which matches no file; expected a picture, or a pattern "
                         "of one picture per frame");
  write_mask("small.png", 1, {95, 64});
  shot_.cameras[0].mask = "small.png";
  EXPECT_EQ(error(), (folder_.path() / "small.png").string() +
                         ": mask of camera 'left': is 95x64 px, expected 96x64 as its footage");
  std::ofstream(folder_.path() / "text.png") << "no picture";
  shot_.cameras[0].mask = "text.png";
  EXPECT_NE(error().find("is not a picture that OpenCV can read"), std::string::npos);
  std::ofstream(folder_.path() / "m.mp4") << "a video";
  shot_.cameras[0].mask = "m.mp4";
  EXPECT_NE(error().find("of which m.mp4 is not a picture"), std::string::npos);
}

}  // namespace
}  // namespace vantage
