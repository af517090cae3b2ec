#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <fstream>
#include <opencv2/calib3d.hpp>

#include "jobs/calibrate/exchange/camera_toml.h"
#include "jobs/calibrate/exchange/nuke_chan.h"
#include "jobs/calibrate/exchange/usd_cameras.h"
#include "jobs/calibrate/known.h"
#include "jobs/vision/undistort.h"
#include "schema/base/error.h"
#include "schema/base/files.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

RigidTransform some_pose(double angle) {
  RigidTransform pose;
  pose.R = Eigen::AngleAxisd(angle, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  pose.t = {0.3, -0.2, 4};
  return pose;
}

class Exchange : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / fmt::format("exchange-{}", getpid());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  static std::string error_of(const std::function<void()>& call) {
    try {
      call();
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::BadInput);
      return e.what();
    }
    return "no error";
  }
  fs::path folder_;
};

TEST_F(Exchange, ChanMeansWhatNukeMeans) {
  // A camera at (1, 2, 10) of a y-up world that looks along -z: our world has y down and z the other way.
  const ChanCamera straight = read_chan(write("a.chan", "7\t1\t2\t10\t0\t0\t0\t40\n"));
  EXPECT_EQ(straight.vfov_deg, 40);
  const RigidTransform& pose = straight.cam_from_world.at(7);
  EXPECT_TRUE(pose.R.isIdentity(1e-12));
  EXPECT_TRUE(pose.centre().isApprox(Eigen::Vector3d(1, -2, -10), 1e-12));
  // Turned by +90 degrees about y it looks along -x, which is ours, too; rolled by +90 its picture's up is -x.
  const RigidTransform turned = read_chan(write("b.chan", "0 0 0 0 0 90 0 40\n")).cam_from_world.at(0);
  EXPECT_TRUE((turned.R.transpose() * Eigen::Vector3d::UnitZ()).isApprox(-Eigen::Vector3d::UnitX(), 1e-12));
  const RigidTransform rolled = read_chan(write("c.chan", "0 0 0 0 0 0 90 40\n")).cam_from_world.at(0);
  EXPECT_TRUE((rolled.R.transpose() * -Eigen::Vector3d::UnitY()).isApprox(-Eigen::Vector3d::UnitX(), 1e-12));
  const RigidTransform both = read_chan(write("d.chan", "0 0 0 0 0 90 90 40\n")).cam_from_world.at(0);
  EXPECT_TRUE((both.R.transpose() * Eigen::Vector3d::UnitZ()).isApprox(-Eigen::Vector3d::UnitX(), 1e-12))
      << "the roll about z comes first and leaves the direction of view alone";
}

TEST_F(Exchange, ChanComesBackAsItWasWritten) {
  const Pinhole pinhole{1920, 1080, 1500, 1500, 960, 540};
  std::map<int, RigidTransform> poses{{0, some_pose(0.4)}, {5, some_pose(-2.0)}, {6, {}}};
  poses[7].R = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitX()).toRotationMatrix();  // straight down
  write_chan(folder_ / "a.chan", pinhole, poses);
  const ChanCamera back = read_chan(folder_ / "a.chan");
  ASSERT_EQ(back.cam_from_world.size(), poses.size());
  for (const auto& [frame, pose] : poses) {
    EXPECT_TRUE(back.cam_from_world.at(frame).R.isApprox(pose.R, 1e-6)) << frame;
    EXPECT_TRUE(back.cam_from_world.at(frame).centre().isApprox(pose.centre(), 1e-6)) << frame;
  }
  EXPECT_NEAR(pinhole_of_vfov(back.vfov_deg, 1920, 1080).fx, 1500, 1e-3);
}

TEST_F(Exchange, BadChanIsNamedByItsLine) {
  EXPECT_NE(
      error_of([&] { read_chan(write("a.chan", "0 1 2 3 4 5 6 40\n1 2 3\n")); }).find("a.chan:2: expected: frame"),
      std::string::npos);
  EXPECT_NE(error_of([&] { read_chan(write("b.chan", "0 1 2 3 4 5 6 400\n")); }).find("angle of view is 400"),
            std::string::npos);
  EXPECT_NE(error_of([&] { read_chan(write("c.chan", "0 0 0 0 0 0 0 40\n1 0 0 0 0 0 0 50\n")); }).find("zoom"),
            std::string::npos);
  EXPECT_NE(error_of([&] { read_chan(write("d.chan", "\n")); }).find("has no frame"), std::string::npos);
}

constexpr const char* kPose2Sim = R"(
[metadata]
adjusted = false

[cam_01]
name = "left"
size = [ 640.0, 360.0]
matrix = [ [ 500.0, 0.0, 320.0], [ 0.0, 505.0, 181.0], [ 0.0, 0.0, 1.0]]
distortions = [ -0.1, 0.02, 0.001, -0.002]
rotation = [ 0.1, -0.2, 0.3]
translation = [ 0.5, 0.1, 3.0]
fisheye = false

[right]
size = [ 640, 360]
matrix = [ [ 500, 0, 320], [ 0, 505, 181], [ 0, 0, 1]]
distortions = [ -0.1, 0.02, 0.001, -0.002, 0.03]
rotation = [ [1, 0, 0], [0, 1, 0], [0, 0, 1]]
translation = [ 0, 0, 3]
)";

TEST_F(Exchange, TomlCameraSeesWhatOpenCvSays) {
  const Calibration read = read_camera_toml(write("cameras.toml", kPose2Sim));
  ASSERT_EQ(read.cameras.size(), 2U);
  const std::vector<cv::Point3d> point{{0.4, -0.3, 1.5}};
  const cv::Matx33d K(500, 0, 320, 0, 505, 181, 0, 0, 1);
  const auto check = [&](const std::string& name, const cv::Vec3d& turn, const cv::Vec3d& shift,
                         const std::vector<double>& terms) {
    std::vector<cv::Point2d> expected;
    cv::projectPoints(point, turn, shift, K, terms, expected);
    const Eigen::Vector3d in_cam = read.pose({name, 0}) * Eigen::Vector3d(0.4, -0.3, 1.5);
    const cv::Point2d px = distort(*read.camera(name).filmed, {in_cam.x() / in_cam.z(), in_cam.y() / in_cam.z()});
    EXPECT_NEAR(px.x, expected[0].x + 0.5, 1e-4) << name;
    EXPECT_NEAR(px.y, expected[0].y + 0.5, 1e-4) << name;
  };
  check("left", {0.1, -0.2, 0.3}, {0.5, 0.1, 3}, {-0.1, 0.02, 0.001, -0.002});
  check("right", {0, 0, 0}, {0, 0, 3}, {-0.1, 0.02, 0.001, -0.002, 0.03});
}

TEST_F(Exchange, TomlComesBackAsItWasWritten) {
  const Calibration first = read_camera_toml(write("cameras.toml", kPose2Sim));
  write_camera_toml(folder_ / "again.toml", first);
  const Calibration again = read_camera_toml(folder_ / "again.toml");
  for (const char* name : {"left", "right"}) {
    EXPECT_EQ(again.camera(name).filmed->model, first.camera(name).filmed->model);
    for (std::size_t i = 0; i < first.camera(name).filmed->params.size(); ++i)
      EXPECT_NEAR(again.camera(name).filmed->params[i], first.camera(name).filmed->params[i], 1e-8);
    EXPECT_TRUE(again.pose({name, 0}).R.isApprox(first.pose({name, 0}).R, 1e-9));
    EXPECT_TRUE(again.pose({name, 0}).t.isApprox(first.pose({name, 0}).t, 1e-9));
  }
}

TEST_F(Exchange, BadTomlIsNamedByItsCamera) {
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = kPose2Sim;
    text.replace(text.find(from), from.size(), to);
    return error_of([&] { read_camera_toml(write("bad.toml", text)); });
  };
  EXPECT_NE(with("rotation = [ 0.1, -0.2, 0.3]", "rotation = [ 0.1]").find("camera [cam_01]: rotation has 1 numbers"),
            std::string::npos);
  EXPECT_NE(with("fisheye = false", "fisheye = true").find("fisheye lens"), std::string::npos);
  EXPECT_NE(with("[right]", "[right]\nname = \"left\"").find("another camera is named 'left'"), std::string::npos);
  EXPECT_NE(with("[ 640.0, 360.0]", "[ 640.0, \"x\"]").find("size holds something that is no number"),
            std::string::npos);
  EXPECT_NE(error_of([&] { read_camera_toml(write("empty.toml", "[metadata]\n")); }).find("has no camera"),
            std::string::npos);
}

FilmedCamera filmed(const std::string& name, int num_frames) {
  FilmedCamera out;
  out.table = {.camera = name,
               .width = 640,
               .height = 360,
               .fps = 30,
               .pts_s = std::vector<double>(static_cast<std::size_t>(num_frames))};
  return out;
}

TEST_F(Exchange, ShotsCanBeCalibratedByEither) {
  const auto by_toml = known_calibration(write("cameras.toml", kPose2Sim), {filmed("left", 3), filmed("right", 2)});
  EXPECT_EQ(by_toml.calibration.cam_from_world.size(), 5U);
  EXPECT_TRUE(by_toml.calibration.camera("left").filmed);
  const auto by_chan = known_from_chan({{"left", write("left.chan", "0 0 0 5 0 0 0 40\n")}}, {filmed("left", 3)});
  EXPECT_EQ(by_chan.calibration.cam_from_world.size(), 3U);
  EXPECT_NEAR(by_chan.calibration.camera("left").pinhole.fy, 180 / std::tan(20 * M_PI / 180), 1e-9);
}

TEST_F(Exchange, UsdHasEveryCameraAndItsFrames) {
  Calibration calibration;
  calibration.cameras["2nd-cam"] = {"2nd-cam", 1, {640, 360, 500, 500, 330, 180}, std::nullopt};
  calibration.cam_from_world[{"2nd-cam", 0}] = {};
  calibration.cam_from_world[{"2nd-cam", 4}] = some_pose(0.2);
  calibration.points.push_back({{1, 2, 3}, {255, 0, 0}, 0, {}});
  write_usd_cameras(folder_ / "cameras.usda", calibration, 1);
  const std::string text = read_file(folder_ / "cameras.usda");
  EXPECT_EQ(text.rfind("#usda 1.0\n", 0), 0U);
  for (const char* part :
       {"def Camera \"_2nd_cam\"", "horizontalApertureOffset = -0.5625", "endTimeCode = 4", "metersPerUnit = 1\n",
        "0: ( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1) )", "point3f[] points = [(1, -2, -3), ]"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
}

}  // namespace
}  // namespace vantage
