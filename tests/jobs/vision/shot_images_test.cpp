#include "jobs/vision/shot_images.h"

#include <gtest/gtest.h>

#include "schema/formats/colour.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

TEST(ShotImages, PicturesComeInTheLookThatTheCamerasShare) {
  const TemporaryFolder folder;
  const auto calibrate = folder.path() / "calibrate", ingest = folder.path() / "ingest";
  std::filesystem::create_directories(calibrate);
  std::filesystem::create_directories(ingest / "frames");
  Calibration calibration;
  calibration.cameras["left"] = {.name = "left", .id = 1, .pinhole = {64, 64, 60, 60, 32, 32}, .filmed = {}};
  calibration.cam_from_world[{"left", 0}] = {};
  write_calibration(calibrate, calibration);
  write_picture(frame_path(ingest, 0), cv::Mat(64, 64, CV_8UC3, cv::Scalar(50, 100, 150)));
  const JobContext context({.unit = {},
                            .inputs = {{"calibrate", calibrate}, {"ingest/left", ingest}},
                            .sources = {},
                            .out_dir = {},
                            .scratch_dir = {},
                            .on_progress = {}});
  EXPECT_EQ(ShotImages(context).bgr({"left", 0}).at<cv::Vec3b>(3, 3), cv::Vec3b(50, 100, 150));

  write_colours(calibrate / "colour.json", {{.name = "left", .gain = {2, 1, 0.5}, .gamma = 1}});
  const auto pixel = ShotImages(context).bgr({"left", 0}).at<cv::Vec3b>(3, 3);
  EXPECT_NEAR(linear_of_level(pixel[2]), 2 * linear_of_level(150), 0.005);
  EXPECT_EQ(pixel[1], 100);
  EXPECT_NEAR(linear_of_level(pixel[0]), 0.5 * linear_of_level(50), 0.001);
  const cv::Vec3f linear = ShotImages(context).linear_bgr({"left", 0})(3, 3);
  EXPECT_NEAR(linear[2], 2 * linear_of_level(150), 1e-6);
  EXPECT_NEAR(linear[1], linear_of_level(100), 1e-6);

  write_picture(frame_path(ingest, 0), cv::Mat(64, 64, CV_16UC3, cv::Scalar(50 * 257 + 64, 100 * 257, 65535)));
  const cv::Vec3f deep = ShotImages(context).linear_bgr({"left", 0})(3, 3);
  EXPECT_NEAR(deep[0], 0.5 * linear_of_level(50 + 64 / 257.0), 1e-6);
  EXPECT_NEAR(deep[1], linear_of_level(100), 1e-6);
  EXPECT_NEAR(deep[2], 2, 1e-6) << "brighter than white is not cut off before it is blended";
}

}  // namespace
}  // namespace vantage
