#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "jobs/views/frame_plan.h"
#include "jobs/views/sphere.h"
#include "jobs/views/virtual_view.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// Three columns of cameras at different heights and distances around the origin (y down), each with two frames.
struct Rig {
  Navspace navspace;
  Calibration calibration;
  Shot shot;
};

Rig uneven_rig() {
  Rig rig;
  rig.navspace.axes << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  const double places[3][3] = {{-10, 2, 4.0}, {1, 14, 5.5}, {12, -3, 4.6}};  // azimuth, elevation, radius
  int id = 0;
  for (const auto& [azimuth, elevation, radius] : places) {
    const std::string name = "cam" + std::to_string(id++);
    rig.shot.cameras.emplace_back().name = name;
    rig.calibration.cameras[name] = {name, id, {320, 180, 300, 300, 160, 90}, {}};
    for (int frame = 0; frame < 2; ++frame) {
      rig.calibration.cam_from_world[{name, frame}] = look_at(world_point(rig.navspace, {azimuth, elevation, radius}),
                                                              rig.navspace.centre, Eigen::Vector3d(0.1, -1, 0));
      rig.navspace.vertices.push_back({{name, frame}, azimuth, elevation, 0.1 * frame});
    }
  }
  rig.navspace.simplices = {{0, 1, 2, 4}, {1, 2, 3, 4}, {1, 3, 4, 5}};
  rig.navspace.edges = {{0, 1}, {0, 2}, {0, 4}, {1, 2}, {1, 4}, {2, 4}, {1, 3}, {2, 3}, {3, 4}, {1, 5}, {3, 5}, {4, 5}};
  return rig;
}

RenderRequest request_of(const std::string& mode, const std::map<std::string, Json>& options = {}) {
  RenderRequest request;
  request.name = "r";
  request.mode = mode;
  request.keyframes = {{0, 0.02, -6, 3}, {1, 0.08, 5, 4}};
  request.options = {"shot.toml", "render", 7, {}};
  for (const auto& [key, value] : options) request.options.values[key] = {value, 9};
  return request;
}

std::vector<VirtualView> views_of(const Rig& rig, const RenderRequest& request) {
  return virtual_views(request, rig.shot, rig.calibration, rig.navspace);
}

Eigen::Vector2d pixel(const VirtualEye& eye, const Eigen::Vector3d& p) {
  return eye.pinhole.project(eye.cam_from_world * p);
}

TEST(StereoViews, ArePairsWithoutVerticalDisparityOnAnyPath) {
  const Rig rig = uneven_rig();
  const auto views = views_of(rig, request_of("stereo", {{"eye_azimuth_deg", 4.0}}));
  ASSERT_GT(views.size(), 20U);
  std::mt19937 random(3);
  const auto uniform = [&] { return 2 * static_cast<double>(random()) / 4294967296.0 - 1; };
  for (const VirtualView& v : views)
    for (int k = 0; k < 20; ++k) {
      const Eigen::Vector3d p(uniform(), uniform(), uniform());
      const Eigen::Vector2d left = pixel(v.eyes[0], p), right = pixel(v.eyes[1], p);
      EXPECT_NEAR(left.y(), right.y(), 1e-9);
      EXPECT_NEAR(left.x() - right.x(), v.stereo->rig.disparity_px((v.cam_from_world * p).z()), 1e-9);
    }
}

TEST(StereoViews, BaselineComesInWorldUnitsDegreesOrPercent) {
  const Rig rig = uneven_rig();
  EXPECT_NEAR(views_of(rig, request_of("stereo", {{"baseline", 0.2}})).at(3).stereo->rig.baseline, 0.2, 1e-12);
  const VirtualView turned = views_of(rig, request_of("stereo", {{"eye_azimuth_deg", 3.0}})).at(3);
  const auto to_centre = [&](const VirtualEye& eye) {
    return (rig.navspace.centre - eye.cam_from_world.centre()).normalized();
  };
  EXPECT_NEAR(std::acos(to_centre(turned.eyes[0]).dot(to_centre(turned.eyes[1]))) * 180 / M_PI, 3, 2e-3);
  const VirtualView far = views_of(rig, request_of("stereo", {{"baseline_percent", 2.0}})).at(3);
  EXPECT_NEAR(far.stereo->rig.disparity_px(1e12), -0.02 * 320, 1e-6);
  const VirtualView near =
      views_of(rig, request_of("stereo-depth", {{"baseline_percent", 1.5}, {"baseline_percent_at", 2.0}})).at(3);
  EXPECT_NEAR(near.stereo->rig.disparity_px(2), 0.015 * 320, 1e-9);
}

TEST(StereoViews, BaselineThatCannotBeIsAnErrorThatSaysWhere) {
  try {
    views_of(uneven_rig(),
             request_of("stereo", {{"baseline_percent", 2.0}, {"baseline_percent_at", 3.0}, {"convergence", 3.0}}));
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("shot.toml:9"), std::string::npos) << e.what();
  }
}

TEST(StereoViews, DisparityPointsMustRise) {
  for (const Json& points :
       {Json({"-2:1", "0:0"}), Json({"1:1", "0:0"}), Json({"0"}), Json({"0:a", "1:1"}), Json({"0:0"})})
    EXPECT_THROW(
        render_options(request_of("stereo-depth", {{"disparity_map", "piecewise"}, {"disparity_points", points}})),
        Error)
        << points;
  const DisparityMapping m = disparity_mapping(
      request_of("stereo-depth", {{"disparity_map", "piecewise"}, {"disparity_points", {"-5:-1", "0:0", "8:2"}}}),
      1000);
  EXPECT_NEAR(disparity_curve(m, {})(50), 10, 1e-6);    // 5 % in front
  EXPECT_NEAR(disparity_curve(m, {})(-80), -20, 1e-6);  // 8 % behind
}

TEST(StereoPlan, KnotsSayWhichDepthTheMapIsMadeFrom) {
  const Rig rig = uneven_rig();
  RenderRequest request = request_of("stereo-depth", {{"disparity_map", "histogram"}});
  request.keyframes = {{0, 0.02, -6, 3}, {3, 0.08, 5, 4}};
  const auto views = views_of(rig, request);
  ASSERT_EQ(views.size(), 91U);
  EXPECT_EQ(views[0].stereo->knots.size(), 1U);
  EXPECT_EQ(views[45].stereo->knots.size(), 2U);
  for (const VirtualView& v : views) {
    const FramePlan plan = plan_frame(v, v, request, rig.calibration, rig.navspace, MatchedEdges(rig.navspace));
    EXPECT_EQ(to_json(frame_plan_from(Json::parse(to_json(plan).dump()))), to_json(plan));
    for (const DisparityKnot& knot : plan.stereo->knots) EXPECT_GE(knot.images.size(), 1U);
    EXPECT_EQ(plan.eyes[0].disparity->sign, 1);
    EXPECT_EQ(plan.eyes[1].disparity->sign, -1);
  }
  EXPECT_TRUE(views_of(rig, request_of("stereo-depth"))[3].stereo->knots.empty());
}

}  // namespace
}  // namespace vantage
