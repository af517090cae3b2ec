#include "schema/formats/exr.h"

#include <ImfInputFile.h>
#include <ImfStandardAttributes.h>
#include <gtest/gtest.h>

#include "schema/base/error.h"
#include "schema/base/hash.h"
#include "schema/formats/exr_camera.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

Plane ramp(int width, int height, float start) {
  Plane p{width, height, std::vector<float>(static_cast<std::size_t>(width * height))};
  for (std::size_t i = 0; i < p.values.size(); ++i) p.values[i] = start + 0.37F * static_cast<float>(i);
  return p;
}

TEST(Exr, FloatChannelsComeBackExactly) {
  const TemporaryFolder folder;
  const Plane u = ramp(7, 5, -3), v = ramp(7, 5, 100);
  write_exr(folder.path() / "f.exr", {{.view = "", .channels = {{"u", u}, {"v", v}}, .half_channels = {}}});
  const Channels back = read_exr(folder.path() / "f.exr");
  EXPECT_EQ(back.at("u").values, u.values);
  EXPECT_EQ(back.at("v").values, v.values);
  EXPECT_EQ(back.at("u").width, 7);
}

TEST(Exr, HalfChannelsAreRoundedToElevenBits) {
  const TemporaryFolder folder;
  const Plane r = ramp(4, 4, 0);
  write_exr(folder.path() / "f.exr", {{.view = "", .channels = {{"R", r}}, .half_channels = {"R"}}});
  const Plane back = read_exr(folder.path() / "f.exr").at("R");
  for (std::size_t i = 0; i < r.values.size(); ++i)
    EXPECT_NEAR(back.values[i], r.values[i], r.values[i] / 1024 + 1e-6F);
}

TEST(Exr, ViewsAreKeptApart) {
  const TemporaryFolder folder;
  write_exr(folder.path() / "s.exr", {{.view = "left", .channels = {{"R", ramp(3, 2, 1)}}, .half_channels = {}},
                                      {.view = "right", .channels = {{"R", ramp(3, 2, 50)}}, .half_channels = {}}});
  EXPECT_EQ(read_exr(folder.path() / "s.exr", "left").at("R").values[0], 1);
  EXPECT_EQ(read_exr(folder.path() / "s.exr", "right").at("R").values[0], 50);
  EXPECT_THROW(read_exr(folder.path() / "s.exr", "middle"), Error);
}

TEST(Exr, TruncatedFileIsRefused) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "f.exr";
  write_exr(file, {{.view = "", .channels = {{"Z", ramp(64, 64, 1)}}, .half_channels = {}}});
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  EXPECT_THROW(read_exr(file), Error);
}

TEST(Exr, SameInputGivesSameBytes) {
  const TemporaryFolder folder;
  for (const char* name : {"a.exr", "b.exr"})
    write_exr(folder.path() / name, {{.view = "", .channels = {{"Z", ramp(33, 17, 2)}}, .half_channels = {}}});
  EXPECT_EQ(hash_file(folder.path() / "a.exr"), hash_file(folder.path() / "b.exr"));
}

TEST(Exr, CamerasAreAttributesForCompositing) {
  const TemporaryFolder folder;
  ExrCamera camera{{200, 100, 150, 160, 90, 60}, {}, 24000 / 1001.0};
  camera.cam_from_world.t = {0.5, -0.25, 2};
  const auto path = folder.path() / "f.exr";
  write_exr(path, {{.view = "", .channels = {{"R", {2, 1, {0, 1}}}}, .half_channels = {}}}, {camera});
  const Imf::InputFile file(path.c_str());
  const Eigen::Vector3d world(0.3, 0.2, 3), p = camera.cam_from_world * world;
  const Imath::V3f point(0.3F, 0.2F, 3);
  const Imath::V3f in_camera = point * Imf::worldToCamera(file.header());
  EXPECT_NEAR(in_camera.x, p.x(), 1e-6);
  EXPECT_NEAR(in_camera.y, -p.y(), 1e-6) << "y is up";
  EXPECT_NEAR(in_camera.z, p.z(), 1e-6);
  const Imath::V3f ndc = point * Imf::worldToNDC(file.header());  // divides by w
  EXPECT_NEAR(ndc.x * 200, camera.pinhole.project(p).x(), 1e-4);
  EXPECT_NEAR(ndc.y * 100, camera.pinhole.project(p).y(), 1e-4);
  EXPECT_EQ(Imf::framesPerSecond(file.header()).n, 24000);
  EXPECT_EQ(Imf::framesPerSecond(file.header()).d, 1001U);
}

}  // namespace
}  // namespace vantage
