#include <gtest/gtest.h>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/formats/clocks.h"
#include "schema/formats/frame_table.h"
#include "schema/formats/navspace.h"
#include "schema/formats/patches.h"
#include "schema/formats/views_file.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

TEST(FrameTable, RoundTrip) {
  const TemporaryFolder folder;
  write_frame_table(folder.path() / "frames.json", {"cam0", 640, 360, 29.97, {0, 0.0333667, 0.07}});
  const FrameTable back = read_frame_table(folder.path());
  EXPECT_EQ(back.pts_s, (std::vector<double>{0, 0.0333667, 0.07}));
  EXPECT_EQ(back.fps, 29.97);
}

TEST(Clocks, RoundTripAndShotTime) {
  const TemporaryFolder folder;
  write_clocks(folder.path() / "clocks.json", {"a", {{"a", 0, 1, 0}, {"b", -0.125, 1.0001, 0.002}}});
  const Clocks back = read_clocks(folder.path());
  ASSERT_NE(back.find("b"), nullptr);
  EXPECT_DOUBLE_EQ(back.find("b")->shot_time_s(10), -0.125 + 10.001);
  EXPECT_EQ(back.find("c"), nullptr);
}

TEST(Navspace, RoundTrip) {
  const TemporaryFolder folder;
  Navspace n;
  n.centre = {1, 2, 3};
  n.radius = 4.5;
  n.vertices = {{{"a", 0}, -1, 2, 0}, {{"b", 0}, 1, 2, 0.1}, {{"a", 1}, -1, 2, 0.2}};
  n.simplices = {{0, 1, 2}};
  n.edges = {{0, 1}, {0, 2}, {1, 2}};
  write_navspace(folder.path() / "navspace.json", n);
  const Navspace back = read_navspace(folder.path());
  EXPECT_EQ(back.centre, n.centre);
  EXPECT_EQ(back.axes, n.axes);
  EXPECT_EQ(back.vertices[2].image, n.vertices[2].image);
  EXPECT_EQ(back.simplices, n.simplices);
  EXPECT_EQ(back.edges, n.edges);
}

TEST(Patches, RoundTripAndTruncationIsRefused) {
  const TemporaryFolder folder;
  Patch p;
  p.position = {1, 2, 3};
  p.velocity = {0.5F, 0, -1};
  p.t0_s = 2;
  p.t1_s = 3;
  p.rgb = {1, 2, 3};
  p.num_views = 7;
  write_patches_ply(folder.path() / "p.ply", {p, p});
  const auto back = read_patches_ply(folder.path() / "p.ply");
  ASSERT_EQ(back.size(), 2U);
  EXPECT_EQ(back[1].num_views, 7);
  EXPECT_EQ(back[1].rgb, p.rgb);
  EXPECT_EQ(back[0].position_at(4), Eigen::Vector3f(2, 2, 1));
  std::filesystem::resize_file(folder.path() / "p.ply", std::filesystem::file_size(folder.path() / "p.ply") - 1);
  EXPECT_THROW(read_patches_ply(folder.path() / "p.ply"), Error);
}

const std::string kView = R"({"frame": 3, "time_s": 0.5, "width": 64, "height": 36, "K": [[50,0,32],[0,50,18],[0,0,1]],
  "R": [[1,0,0],[0,1,0],[0,0,1]], "t": [1,2,3], "baseline": 0.065})";

TEST(ViewsFile, ReadsViewsAndAnchors) {
  const TemporaryFolder folder;
  write_file_atomically(
      folder.path() / "v.json",
      R"({"version": 1, "views": [)" + kView +
          R"(], "anchors": [{"camera": "cam0", "frame": 0, "R": [[1,0,0],[0,1,0],[0,0,1]], "t": [0,0,0]}]})");
  const ViewsFile file = read_views_file(folder.path() / "v.json");
  ASSERT_EQ(file.views.size(), 1U);
  EXPECT_EQ(file.views[0].baseline, 0.065);
  EXPECT_EQ(file.views[0].pinhole.cx, 32);
  EXPECT_EQ(file.anchors.at(0).image.camera, "cam0");
}

TEST(ViewsFile, SaysWhichViewIsWrong) {
  const TemporaryFolder folder;
  std::string mirrored = kView;
  mirrored.replace(mirrored.find("[[1,0,0],[0,1,0]"), 16, "[[-1,0,0],[0,1,0]");
  write_file_atomically(folder.path() / "v.json", R"({"views": [)" + kView + "," + mirrored + "]}");
  try {
    read_views_file(folder.path() / "v.json");
    FAIL() << "expected an error";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("view 1: R is not a rotation"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace vantage
