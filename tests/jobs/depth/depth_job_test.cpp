#include "jobs/depth/depth_job.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <set>
#include <string>

#include "jobs/vision/maps.h"
#include "jobs/vision/shot_images.h"
#include "schema/formats/calibration.h"
#include "schema/formats/frame_table.h"
#include "schema/formats/navspace.h"
#include "tests/support/synthetic_scene.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

using synthetic::SceneCamera;

/// Two cameras of two frames each, the second camera late by half a frame; correspondences are exact.
class DepthJobTest : public testing::Test {
 protected:
  DepthJobTest() : cameras_(synthetic::arc_cameras(2, 2, 160, 90)) {
    cameras_[0].offset_s = 0.2;
    cameras_[1].offset_s = 0.2 + 0.5 / cameras_[1].fps;
    shot_.sections["depth"] = {"shot.toml", "depth", 3, {}};
    Calibration calibration;
    for (const SceneCamera& camera : cameras_) {
      shot_.cameras.emplace_back().name = camera.name;
      calibration.cameras[camera.name] = {camera.name, static_cast<int>(calibration.cameras.size()) + 1, camera.pinhole,
                                          std::nullopt};
      for (int frame = 0; frame < 2; ++frame) calibration.cam_from_world[{camera.name, frame}] = camera.cam_from_world;
    }
    write_calibration(artifact("calibrate"), calibration);
    write_space(0);
  }

  std::filesystem::path artifact(const std::string& job) {
    const auto path = folder_.path() / job;
    std::filesystem::create_directories(path);
    return path;
  }
  /// later_s: how much later all of it happens by the shot's clock.
  void write_space(double later_s) {
    Navspace navspace;
    for (const SceneCamera& camera : cameras_)
      for (int frame = 0; frame < 2; ++frame)
        navspace.vertices.push_back({{camera.name, frame}, 0, 0, camera.time_s(frame) + later_s});
    navspace.edges = {{0, 1}, {0, 2}, {1, 2}, {1, 3}, {2, 3}};
    write_navspace(artifact("navspace") / "navspace.json", navspace);
  }
  std::vector<WorkUnit> split() {
    return DepthJob::split(
        ShotState(shot_,
                  [&](const std::string& job) -> std::optional<std::filesystem::path> { return folder_.path() / job; }),
        {});
  }
  std::string label(int camera, int frame) const {
    return ImageId{cameras_[static_cast<std::size_t>(camera)].name, frame}.label();
  }

  static const WorkUnit& unit_named(const std::vector<WorkUnit>& units, const std::string& name) {
    const auto found = std::find_if(units.begin(), units.end(), [&](const WorkUnit& u) { return u.name == name; });
    EXPECT_NE(found, units.end()) << name;
    return *found;
  }
  static bool needs(const WorkUnit& unit, const std::string& job) {
    return std::count(unit.needs.begin(), unit.needs.end(), job) == 1;
  }
  std::string correspondence(int a, int b) const {
    return "correspond/" + label(a / 2, a % 2) + "__" + label(b / 2, b % 2);
  }
  /// Runs a unit; its artifact is where later units look for it.
  void run(const WorkUnit& unit) {
    JobContext::Config config{.unit = unit.unit,
                              .inputs = {},
                              .sources = {},
                              .out_dir = artifact(unit.name),
                              .scratch_dir = artifact("scratch"),
                              .cores = 1,
                              .on_progress = {}};
    for (const std::string& need : unit.needs) config.inputs[need] = folder_.path() / need;
    JobContext context(config);
    DepthJob::run(context, params_from_json<DepthJob::Params>(unit.params));
  }

  synthetic::Picture expose(int vertex) const {
    const SceneCamera& c = cameras_[static_cast<std::size_t>(vertex / 2)];
    return scene_.render(c.pinhole, c.cam_from_world, c.time_s(vertex % 2));
  }
  FlowMap exact_flow(int from, int to) const {
    const SceneCamera &a = cameras_[static_cast<std::size_t>(from / 2)],
                      &b = cameras_[static_cast<std::size_t>(to / 2)];
    const synthetic::Truth truth = scene_.correspondence(expose(from), a.pinhole, a.cam_from_world, a.time_s(from % 2),
                                                         b.pinhole, b.cam_from_world, b.time_s(to % 2));
    FlowMap flow{truth.motion_px.clone(), cv::Mat1f(truth.visible.size(), 0.0F)};
    flow.confidence.setTo(1.0F, truth.visible);
    return flow;
  }
  void write_correspondences(int a, int b) {
    const auto folder = artifact(correspondence(a, b));
    write_flow(folder / "forward.exr", exact_flow(a, b));
    write_flow(folder / "backward.exr", exact_flow(b, a));
  }

  TemporaryFolder folder_;
  std::vector<SceneCamera> cameras_;
  synthetic::Scene scene_;
  Shot shot_;
};

TEST_F(DepthJobTest, NeedsTheEdgesToOtherViewpointsAndTheMotionAtTheirEnds) {
  const auto units = split();
  ASSERT_EQ(units.size(), 8U);
  const WorkUnit& unit = unit_named(units, "depth/" + label(1, 0) + "/single");
  EXPECT_TRUE(needs(unit, correspondence(0, 2)));
  EXPECT_TRUE(needs(unit, correspondence(1, 2)));
  EXPECT_TRUE(needs(unit, correspondence(0, 1)));   // how things move in the other camera
  EXPECT_FALSE(needs(unit, correspondence(2, 3)));  // the camera's own next frame has no parallax
  EXPECT_FALSE(unit.unit.at("edges").at(0).at("forward").get<bool>());
  EXPECT_NEAR(unit.unit.at("edges").at(0).at("lag_s").get<double>(), 0.5 / 30, 1e-6);
}

TEST_F(DepthJobTest, ThenHearsTheFrameAfter) {
  const auto units = split();
  const WorkUnit& unit = unit_named(units, "depth/" + label(1, 0));
  EXPECT_TRUE(needs(unit, "depth/" + label(1, 0) + "/single"));
  EXPECT_TRUE(needs(unit, "depth/" + label(1, 1) + "/single"));
  EXPECT_TRUE(needs(unit, correspondence(2, 3)));
  EXPECT_EQ(unit.links.size(), 1U);
}

TEST_F(DepthJobTest, WhatAJobNeedsStandsBeforeIt) {
  std::set<std::string> before;
  for (const WorkUnit& unit : split()) {
    for (const std::string& need : unit.needs) {
      const bool is_depth = need.starts_with("depth/");
      EXPECT_TRUE(!is_depth || before.contains(need)) << unit.name << " needs " << need;
    }
    before.insert(unit.name);
  }
}

TEST_F(DepthJobTest, OnlyDifferencesOfTimeMatter) {
  const auto before = split();
  write_space(0.73);
  const auto after = split();
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t k = 0; k < before.size(); ++k) EXPECT_EQ(before[k].unit, after[k].unit);
}

TEST_F(DepthJobTest, RunWritesDepthOfStillAndMovingThings) {
  for (const auto& [a, b] : {std::pair(0, 1), {0, 2}, {1, 2}, {1, 3}, {2, 3}}) write_correspondences(a, b);
  const synthetic::Picture image = expose(2);
  const auto ingest = artifact("ingest/" + cameras_[1].name);
  std::filesystem::create_directories(frame_path(ingest, 0).parent_path());
  write_picture(frame_path(ingest, 0), image.bgr);

  const auto units = split();
  for (const std::string& name : {label(1, 0) + "/single", label(1, 1) + "/single", label(1, 0)})
    run(unit_named(units, "depth/" + name));

  const std::filesystem::path out = folder_.path() / "depth" / label(1, 0);
  const DepthMap depth = read_depth(out / "depth.exr");
  std::vector<float> still, moving;
  for (int y = 0; y < depth.z.rows; ++y)
    for (int x = 0; x < depth.z.cols; ++x)
      if (depth.z(y, x) > 0 && image.depth(y, x) > 0)
        (image.id(y, x) >= synthetic::kFirstMovingId ? moving : still)
            .push_back(std::abs(depth.z(y, x) / image.depth(y, x) - 1));
  ASSERT_GT(still.size(), image.depth.total() / 2);
  ASSERT_GT(moving.size(), 20U);
  const auto median = [](std::vector<float>& v) {
    std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
    return v[v.size() / 2];
  };
  EXPECT_LT(median(still), 0.002F);
  EXPECT_LT(median(moving), 0.01F);
  EXPECT_TRUE(std::filesystem::exists(out / "preview.jpg"));
}

}  // namespace
}  // namespace vantage
