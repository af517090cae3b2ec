#include "schema/formats/calibration.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

Calibration example() {
  Calibration c;
  c.cameras["left"] = {"left", 1, {640, 360, 500.25, 501.5, 320, 180}, std::nullopt};
  c.cameras["right"] = {
      "right", 2, {640, 360, 510, 510, 321, 179}, LensModel{"SIMPLE_RADIAL", 640, 360, {512, 320, 180, -0.05}}};
  RigidTransform pose;
  pose.R = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  pose.t = {0.1, -2, 5};
  c.cam_from_world[{"left", 0}] = pose;
  c.cam_from_world[{"right", 12}] = pose;
  c.points.push_back({{1, 2, 3}, {10, 20, 30}, 0.5, {{"left", 0}, {"right", 12}}});
  return c;
}

TEST(Calibration, RoundTripKeepsPosesLensesAndPoints) {
  const TemporaryFolder folder;
  const Calibration c = example();
  write_calibration(folder.path(), c);
  const Calibration back = read_calibration(folder.path());
  ASSERT_EQ(back.cam_from_world.size(), 2U);
  EXPECT_TRUE(back.pose({"right", 12}).R.isApprox(c.pose({"right", 12}).R, 1e-12));
  EXPECT_TRUE(back.pose({"left", 0}).t.isApprox(c.pose({"left", 0}).t, 1e-12));
  EXPECT_EQ(back.camera("left").pinhole.fy, 501.5);
  EXPECT_FALSE(back.camera("left").filmed.has_value());
  ASSERT_TRUE(back.camera("right").filmed.has_value());
  EXPECT_EQ(back.camera("right").filmed->params, c.camera("right").filmed->params);
  ASSERT_EQ(back.points.size(), 1U);
  EXPECT_EQ(back.points[0].seen_in, c.points[0].seen_in);
}

TEST(Calibration, ErrorsNameFileAndLine) {
  const TemporaryFolder folder;
  write_calibration(folder.path(), example());
  write_file_atomically(folder.path() / "cameras.txt",
                        "1 PINHOLE 640 360 500 500 320 180\n2 FISHEYE 640 360 1 1 1 1\n");
  try {
    read_calibration(folder.path());
    FAIL() << "expected an error";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("cameras.txt:2"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("FISHEYE"), std::string::npos) << e.what();
  }
}

TEST(ImageId, LabelsRoundTripAlsoWithDashesInNames) {
  const ImageId id{"cam-left-2", 37};
  EXPECT_EQ(id.label(), "cam-left-2-000037");
  EXPECT_EQ(ImageId::parse(id.label()), id);
  EXPECT_FALSE(ImageId::parse("cam").has_value());
  EXPECT_FALSE(ImageId::parse("cam-12x").has_value());
}

}  // namespace
}  // namespace vantage
