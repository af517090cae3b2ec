#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "jobs/fuse/fuse_job.h"
#include "jobs/fuse/surface.h"
#include "schema/formats/calibration.h"
#include "schema/formats/patches.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

/// A ball of radius 0.5 at z = 4 as patches.
std::vector<Patch> ball(int count, float t0, float t1) {
  std::vector<Patch> out;
  for (int k = 0; k < count; ++k) {  // Fibonacci sphere
    const double z = 1 - (2 * k + 1.0) / count, r = std::sqrt(1 - z * z),
                 a = k * std::numbers::pi * (3 - std::sqrt(5.0));
    Patch p;
    p.normal = Eigen::Vector3d(r * std::cos(a), r * std::sin(a), z).cast<float>();
    p.position = Eigen::Vector3f(0, 0, 4) + 0.5F * p.normal;
    p.t0_s = t0;
    p.t1_s = t1;
    p.rgb = {200, 100, 50};
    p.num_views = 4;
    p.score = 0.9F;
    out.push_back(p);
  }
  return out;
}

struct Fixture {
  TemporaryFolder folder;
  JobContext::Config config;

  explicit Fixture(const std::vector<std::vector<Patch>>& groups) {
    Calibration calibration;
    calibration.cameras["cam0"] = {"cam0", 1, {320, 240, 300, 300, 160, 120}, {}};
    calibration.cam_from_world[{"cam0", 0}] = {};
    make("calibrate");
    write_calibration(config.inputs["calibrate"], calibration);
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const std::string name = "reconstruct/000" + std::to_string(g);
      make(name);
      write_patches_ply(config.inputs[name] / "patches.ply", groups[g]);
    }
    config.unit["groups"] = groups.size();
    config.out_dir = folder.path() / "out";
    config.scratch_dir = folder.path() / "scratch";
    fs::create_directories(config.out_dir);
    fs::create_directories(config.scratch_dir);
  }
  void make(const std::string& name) {
    config.inputs[name] = folder.path() / name;
    fs::create_directories(config.inputs[name]);
  }
  std::string header(const std::string& file) const {
    std::ifstream in(config.out_dir / file);
    std::string text, line;
    while (std::getline(in, line) && line != "end_header") text += line + "\n";
    return text;
  }
};

TEST(FuseRun, WritesModelPointsAndSurface) {
  Fixture fixture({ball(4000, -0.2F, 0), ball(4000, -0.1F, 0.1F)});
  JobContext context(fixture.config);
  FuseJob::Params params;
  params.surface_depth = 6;
  params.surface_trim = 4;
  FuseJob::run(context, params);
  const auto model = read_patches_ply(fixture.config.out_dir / "patches.ply");
  EXPECT_EQ(model.size(), 4000U);
  EXPECT_FLOAT_EQ(model.front().t0_s, -0.2F);
  EXPECT_FLOAT_EQ(model.front().t1_s, 0.1F);
  EXPECT_NE(fixture.header("points/points_-100.ply").find("element vertex 4000"), std::string::npos);
  EXPECT_NE(fixture.header("points/points_0.ply").find("element vertex 4000"), std::string::npos);
  EXPECT_GT(context.figures().at("surface_vertices").get<int>(), 200);
  EXPECT_NE(fixture.header("surface.ply").find("element face"), std::string::npos);
  EXPECT_EQ(fixture.header("surface.ply").find("comment"), std::string::npos)
      << "folders and timings would differ from run to run";
  EXPECT_TRUE(fs::exists(fixture.config.out_dir / "preview.jpg"));
}

TEST(FuseRun, TooFewPatchesGiveSquaresAndSaySo) {
  Fixture fixture({ball(50, 0, 0.1F)});
  JobContext context(fixture.config);
  FuseJob::run(context, {});
  EXPECT_NE(fixture.header("surface.ply").find("element vertex 200"), std::string::npos);
  EXPECT_NE(fixture.header("surface.ply").find("element face 100"), std::string::npos);
  EXPECT_EQ(context.figures().at("warnings").size(), 1U);
}

TEST(FuseRun, AnEmptyModelIsStillAModel) {
  Fixture fixture({{}, {}});
  JobContext context(fixture.config);
  FuseJob::run(context, {});
  EXPECT_TRUE(read_patches_ply(fixture.config.out_dir / "patches.ply").empty());
  EXPECT_NE(fixture.header("surface.ply").find("element vertex 0"), std::string::npos);
  EXPECT_GE(context.figures().at("warnings").size(), 1U);
}

}  // namespace
}  // namespace vantage
