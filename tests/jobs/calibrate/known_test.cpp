#include "jobs/calibrate/known.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "jobs/calibrate/calibrate_job.h"
#include "jobs/vision/undistort.h"
#include "schema/base/error.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

FilmedCamera filmed(const std::string& name, int num_frames, bool moving = false) {
  FilmedCamera out;
  out.table = {.camera = name,
               .width = 640,
               .height = 360,
               .fps = 30,
               .pts_s = std::vector<double>(static_cast<std::size_t>(num_frames))};
  out.moving = moving;
  return out;
}

class Known : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / fmt::format("known-{}", getpid());
    fs::create_directories(folder_);
    write("cameras.txt", "1 PINHOLE 640 360 500 510 322 181\n2 OPENCV 640 360 500 510 322 181 -0.1 0.02 0.001 0\n");
    write("images.txt",
          "1 1 0 0 0 0.5 0 3 1 left/000000.png\n\n2 0.8 0 0.6 0 0 0 3 2 right/000000.png\n\n3 0.6 0 0.8 0 0 1 3 2 "
          "right/000002.png\n\n");
    write("points3D.txt", "1 0.1 0.2 0.3 10 20 30 0.5 1 0 2 0\n");
  }
  void TearDown() override { fs::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }
  std::string error_of(const std::vector<FilmedCamera>& cameras) {
    try {
      known_calibration(folder_, cameras);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::BadInput);
      return e.what();
    }
    return "no error";
  }
  fs::path folder_;
};

TEST_F(Known, StaticPoseHoldsForAllFrames) {
  const auto known = known_calibration(folder_, {filmed("left", 4), filmed("right", 4)});
  EXPECT_TRUE(known.warnings.empty());
  EXPECT_EQ(known.calibration.cam_from_world.size(), 8U);
  EXPECT_EQ(known.calibration.pose({"left", 3}).t, Eigen::Vector3d(0.5, 0, 3));
  EXPECT_EQ(known.calibration.pose({"right", 1}).t, Eigen::Vector3d(0, 0, 3));
  EXPECT_EQ(known.calibration.pose({"right", 3}).t, Eigen::Vector3d(0, 1, 3));
  EXPECT_EQ(known.calibration.points.size(), 1U);
}

TEST_F(Known, MovingCameraKeepsOnlyFramesWithAPose) {
  const auto known = known_calibration(folder_, {filmed("left", 1), filmed("right", 4, true)});
  EXPECT_EQ(known.calibration.cam_from_world.size(), 3U);
  ASSERT_EQ(known.warnings.size(), 1U);
  EXPECT_EQ(known.warnings[0], "camera 'right' moves, and 2 of its 4 frames have no pose");
}

TEST_F(Known, LensBecomesPinholeWithTheLensBesideIt) {
  const auto known = known_calibration(folder_, {filmed("left", 1), filmed("right", 1)});
  EXPECT_FALSE(known.calibration.camera("left").filmed);
  ASSERT_TRUE(known.calibration.camera("right").filmed);
  EXPECT_EQ(known.calibration.camera("right").pinhole.fx,
            undistorted_pinhole(*known.calibration.camera("right").filmed).fx);
  // Written and read again nothing changes.
  write_calibration(folder_ / "again", known.calibration);
  const auto again = known_calibration(folder_ / "again", {filmed("left", 1), filmed("right", 1)});
  EXPECT_EQ(again.calibration.camera("right").pinhole.fx, known.calibration.camera("right").pinhole.fx);
  EXPECT_EQ(again.calibration.camera("right").filmed->params, known.calibration.camera("right").filmed->params);
  EXPECT_TRUE(again.calibration.pose({"right", 0}).R.isApprox(known.calibration.pose({"right", 0}).R, 1e-12));
}

TEST_F(Known, NamesTheCameraThatDoesNotFit) {
  EXPECT_NE(error_of({filmed("left", 1), filmed("top", 1)})
                .find("has no image of camera 'top'; it has images of: left, right"),
            std::string::npos);
  FilmedCamera small = filmed("left", 1);
  small.table.width = 320;
  EXPECT_NE(error_of({small, filmed("right", 1)})
                .find("camera 'left' has pictures of 640x360 px, but its footage is 320x360"),
            std::string::npos);
}

TEST_F(Known, CheckPointsAtTheLineOfTheModel) {
  Shot shot;
  shot.folder = folder_.parent_path();
  Section section{.file = "shot.toml",
                  .name = "calibrate",
                  .line = 3,
                  .values = {{"method", {"known", 4}}, {"model", {"nowhere", 5}}}};
  shot.sections["calibrate"] = section;
  try {
    CalibrateJob::check(shot);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(
        std::string(e.what()),
        "shot.toml:5: [calibrate] model: nowhere has no cameras.txt; expected a COLMAP text model or a .toml file");
  }
  shot.sections["calibrate"].values["model"].value = folder_.filename().string();
  CalibrateJob::check(shot);
  // Without a model every camera needs a file of its own.
  shot.sections["calibrate"].values.erase("model");
  shot.cameras.resize(1);
  shot.cameras[0].name = "left";
  EXPECT_THROW(CalibrateJob::check(shot), Error);
  write("left.chan", "0 0 0 0 0 0 0 40\n");
  shot.cameras[0].calibration = folder_.filename().string() + "/left.chan";
  CalibrateJob::check(shot);
}

TEST_F(Known, CheckWantsTwoStandingCamerasForADistance) {
  Shot shot;
  shot.folder = folder_;
  shot.cameras.resize(3);
  shot.cameras[0].name = "left", shot.cameras[1].name = "right", shot.cameras[2].name = "held";
  shot.cameras[2].moving = true;
  const auto error_with = [&](const std::string& names, double metres) -> std::string {
    shot.sections["calibrate"] = {.file = "shot.toml",
                                  .name = "calibrate",
                                  .line = 3,
                                  .values = {{"known_distance", {names, 4}}, {"known_distance_m", {metres, 5}}}};
    try {
      CalibrateJob::check(shot);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(error_with("left right", 2), "");
  EXPECT_EQ(error_with("left ground", 2), "");
  EXPECT_NE(error_with("left", 2).find("shot.toml:4"), std::string::npos);
  EXPECT_NE(error_with("left held", 2).find("expected two of the cameras that do not move"), std::string::npos);
  EXPECT_NE(error_with("left right", 0).find("are needed together"), std::string::npos);
}

TEST_F(Known, KeyHoldsNothingThatDoesNotMatter) {
  Shot shot;
  shot.folder = folder_;
  shot.cameras.resize(2);
  shot.cameras[0].name = "left", shot.cameras[1].name = "right";
  CalibrateJob::Params params;
  params.method = "known", params.model = ".", params.max_features = 1234;
  const auto units = CalibrateJob::split(ShotState(shot, [](const std::string&) { return std::nullopt; }), params);
  EXPECT_EQ(units.at(0).params, (Json{{"method", "known"}, {"match_colour", true}}));
  EXPECT_EQ(units[0].needs, (std::vector<std::string>{"ingest/left", "ingest/right"}));
  EXPECT_EQ(units[0].sources.size(), 3U);
}

}  // namespace
}  // namespace vantage
