#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "jobs/views/frame_plan.h"
#include "jobs/views/hull_limits.h"
#include "jobs/views/key_frames.h"
#include "jobs/views/nav_locator.h"
#include "jobs/views/similarity.h"
#include "jobs/views/sphere.h"
#include "jobs/views/virtual_view.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr double kRadPerDeg = M_PI / 180;

/// Cameras 8 degrees apart on a level arc of radius 4 about the origin (y down), each with images 0.1 s apart; joined
/// as triangles by hand.
struct Rig {
  Navspace navspace;
  Calibration calibration;
  Shot shot;
};

Rig arc_rig(int num_cameras, int num_frames) {
  Rig rig;
  rig.navspace.axes << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  rig.navspace.radius = 4;
  for (int c = 0; c < num_cameras; ++c) {
    const std::string name = "cam" + std::to_string(c);
    rig.shot.cameras.push_back({.name = name,
                                .footage = "",
                                .fps = {},
                                .start_s = {},
                                .trim_end_s = {},
                                .mask = "",
                                .key_color = "",
                                .calibration = ""});
    rig.calibration.cameras[name] = {name, c + 1, {320, 180, 300, 300, 160, 90}, {}};
    const double azimuth = 8.0 * c - 4.0 * (num_cameras - 1);
    const Eigen::Vector3d eye = world_point(rig.navspace, {azimuth, 0, 4.0 + 0.1 * c});
    for (int k = 0; k < num_frames; ++k) {
      rig.calibration.cam_from_world[{name, k}] = look_at(eye, rig.navspace.centre, {0, -1, 0});
      rig.navspace.vertices.push_back({{name, k}, azimuth, 0, 0.1 * k});
    }
  }
  const auto vertex = [&](int c, int k) { return c * num_frames + k; };
  for (int c = 0; c + 1 < num_cameras; ++c)
    for (int k = 0; k + 1 < num_frames; ++k) {
      rig.navspace.simplices.push_back({vertex(c, k), vertex(c, k + 1), vertex(c + 1, k)});
      rig.navspace.simplices.push_back({vertex(c, k + 1), vertex(c + 1, k), vertex(c + 1, k + 1)});
    }
  for (int c = 0; c < num_cameras; ++c)
    for (int k = 0; k < num_frames; ++k) {
      if (k + 1 < num_frames) rig.navspace.edges.emplace_back(vertex(c, k), vertex(c, k + 1));
      if (c + 1 < num_cameras) rig.navspace.edges.emplace_back(vertex(c, k), vertex(c + 1, k));
      if (c + 1 < num_cameras && k + 1 < num_frames)
        rig.navspace.edges.emplace_back(vertex(c, k + 1), vertex(c + 1, k));
    }
  return rig;
}

NavPoint point_of(const Navspace& n, const NavLocation& location) {
  NavPoint p;
  for (std::size_t k = 0; k < location.vertices.size(); ++k) {
    const NavVertex& v = n.vertices[static_cast<std::size_t>(location.vertices[k])];
    p.azimuth_deg += location.weights[k] * v.azimuth_deg;
    p.elevation_deg += location.weights[k] * v.elevation_deg;
    p.time_s += location.weights[k] * v.time_s;
  }
  return p;
}

TEST(Locate, WeightsReproduceThePoint) {
  const Rig rig = arc_rig(4, 5);
  const NavLocator locator(rig.navspace);
  std::mt19937 random(1);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  for (int k = 0; k < 1000; ++k) {
    const NavPoint p{uniform(-12, 12), 3, uniform(0, 0.4)};
    const NavLocation found = locator.locate(p);
    EXPECT_FALSE(found.outside);
    double sum = 0;
    for (const double w : found.weights) {
      EXPECT_GE(w, 0);
      sum += w;
    }
    EXPECT_NEAR(sum, 1, 1e-12);
    EXPECT_NEAR(point_of(rig.navspace, found).azimuth_deg, p.azimuth_deg, 1e-9);
    EXPECT_NEAR(point_of(rig.navspace, found).time_s, p.time_s, 1e-9);
  }
}

TEST(Locate, TetrahedronWeightsReproduceThePoint) {
  Navspace n;
  n.vertices = {{{"a", 0}, 0, 0, 0}, {{"b", 0}, 10, 0, 0.01}, {{"c", 0}, 0, 10, 0.02}, {{"a", 1}, 0, 0, 0.04}};
  n.simplices = {{0, 1, 2, 3}};
  const NavLocation found = locate(n, {2, 3, 0.018});
  EXPECT_FALSE(found.outside);
  const NavPoint p = point_of(n, found);
  EXPECT_NEAR(p.azimuth_deg, 2, 1e-9);
  EXPECT_NEAR(p.elevation_deg, 3, 1e-9);
  EXPECT_NEAR(p.time_s, 0.018, 1e-9);
}

TEST(Locate, PointsOutsideMoveToTheNearestPlace) {
  const Rig rig = arc_rig(3, 4);
  const NavLocation found = locate(rig.navspace, {-20, 0, 0.17});
  EXPECT_TRUE(found.outside);
  EXPECT_NEAR(point_of(rig.navspace, found).azimuth_deg, -8, 1e-9);
  EXPECT_NEAR(point_of(rig.navspace, found).time_s, 0.17, 1e-9);
}

TEST(Locate, WeightsAreTheSameFromBothSidesOfAWall) {
  const Rig rig = arc_rig(3, 4);
  const NavLocator locator(rig.navspace);
  std::map<int, double> left, right;
  for (const auto& [side, weights] : {std::pair{-1e-10, &left}, {1e-10, &right}}) {
    const NavLocation found = locator.locate({side, 0, 0.13});
    for (std::size_t k = 0; k < found.vertices.size(); ++k) (*weights)[found.vertices[k]] += found.weights[k];
  }
  for (int v = 0; v < 12; ++v) EXPECT_NEAR(left[v], right[v], 1e-6);
}

TEST(KeyFrames, FreezeAndRotateKeepsTimeExactlyStill) {
  const std::vector<KeyFrame> keys{{0, 0, 0, 0}, {1, 0.5, 0, 0}, {2, 0.5, 10, 0}, {3, 1, 10, 0}};
  for (double at = 1; at <= 2; at += 0.05) EXPECT_EQ(path_at(keys, at).time_s, 0.5);
  double last = -1;
  for (double at = 0; at <= 3; at += 0.01) {
    const double azimuth = path_at(keys, at).azimuth_deg;
    EXPECT_GE(azimuth, last);
    EXPECT_LE(azimuth, 10);
    last = azimuth;
  }
}

TEST(KeyFrames, PathMeetsItsKeysAndIsSmooth) {
  const std::vector<KeyFrame> keys{{0, 0, -5, 1}, {0.7, 0.2, 3, 2}, {1.5, 0.9, 8, -1}};
  for (const KeyFrame& key : keys) {
    EXPECT_NEAR(path_at(keys, key.at_s).time_s, key.time_s, 1e-12);
    EXPECT_NEAR(path_at(keys, key.at_s).azimuth_deg, key.azimuth_deg, 1e-12);
  }
  const double h = 1e-5;
  const auto speed = [&](double at) { return (path_at(keys, at + h).time_s - path_at(keys, at).time_s) / h; };
  EXPECT_NEAR(speed(0.7 - 2 * h), speed(0.7 + h), 1e-3);
  EXPECT_EQ(path_frames(keys, 10), (std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}));
}

RenderRequest request_of(const std::string& mode) {
  RenderRequest request;
  request.name = "r";
  request.mode = mode;
  return request;
}

RigidTransform random_pose(std::mt19937& random) {
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0 - 0.5; };
  RigidTransform pose;
  pose.R = Eigen::Quaterniond(uniform(), uniform(), uniform(), uniform()).normalized().toRotationMatrix();
  pose.t = {4 * uniform(), 4 * uniform(), 4 * uniform()};
  return pose;
}

Similarity some_similarity() {
  return {2.5, Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix(), {3, -1, 7}};
}

TEST(Similarity, ComesBackExactlyFromPoses) {
  std::mt19937 random(2);
  std::vector<RigidTransform> from, to;
  for (int k = 0; k < 6; ++k) {
    from.push_back(random_pose(random));
    to.push_back(some_similarity() * from.back());
  }
  const Similarity found = align_poses(from, to, 5);
  EXPECT_NEAR(found.scale, 2.5, 1e-9);
  EXPECT_NEAR((found.R - some_similarity().R).norm(), 0, 1e-9);
  EXPECT_NEAR((found.t - some_similarity().t).norm(), 0, 1e-8);
}

TEST(Similarity, CentresOnALineTakeTheTurnFromTheOrientations) {
  std::mt19937 random(4);
  std::vector<RigidTransform> from, to;
  for (int k = 0; k < 2; ++k) {
    from.push_back(random_pose(random));
    to.push_back(some_similarity() * from.back());
  }
  const Similarity found = align_poses(from, to, 5);
  EXPECT_NEAR(found.scale, 2.5, 1e-9);
  EXPECT_NEAR((found.R - some_similarity().R).norm(), 0, 1e-9);
}

/// A flat arc's centres, each a millimetre off, leave the turn about its chord open by 0.3 mrad; what its cameras look
/// at does not.
TEST(Similarity, FlatArcsTurnIsKnownFromWhatTheCamerasLookAt) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0, 0.001);
  std::vector<RigidTransform> from, to;
  for (int k = 0; k < 8; ++k) {
    RigidTransform pose;
    pose.R = Eigen::AngleAxisd(0.08 * (k - 3.5), Eigen::Vector3d::UnitY()).toRotationMatrix();
    pose.t = {0, 0, 5};
    from.push_back(pose);
    RigidTransform found = some_similarity() * pose;
    found.t += 2.5 * Eigen::Vector3d(noise(random), noise(random), noise(random));
    to.push_back(found);
  }
  const Similarity found = align_poses(from, to, 2.5 * 5);
  EXPECT_LT(Eigen::AngleAxisd(found.R * some_similarity().R.transpose()).angle(), 1e-4);
}

TEST(Similarity, MappedCameraSeesMappedPointsAtTheSamePixel) {
  std::mt19937 random(9);
  const RigidTransform pose = random_pose(random), mapped = some_similarity() * pose;
  const Eigen::Vector3d point(0.3, -0.2, 1.7);
  const Eigen::Vector3d before = pose * point, after = mapped * (some_similarity() * point);
  EXPECT_NEAR((after - 2.5 * before).norm(), 0, 1e-9);
}

TEST(Similarity, TooFewAnchorsIsAnError) {
  const Rig rig = arc_rig(2, 1);
  EXPECT_THROW(calibration_from_views({{{"nobody", 0}, {}}}, rig.calibration, 1), Error);
}

TEST(VirtualViews, KeyFramesStayOnTheCameraSurfaceLookingAtTheCentre) {
  const Rig rig = arc_rig(3, 4);
  RenderRequest request = request_of("view");
  request.fps = 10;
  request.keyframes = {{0, 0.05, -4, 0}, {0.4, 0.25, 6, 0}};
  const auto views = virtual_views(request, rig.shot, rig.calibration, rig.navspace);
  ASSERT_EQ(views.size(), 5U);
  for (const VirtualView& v : views) {
    const Eigen::Vector3d centre = v.cam_from_world * rig.navspace.centre;
    EXPECT_NEAR(centre.head<2>().norm(), 0, 1e-9);
    EXPECT_NEAR(v.cam_from_world.R(0, 1), 0, 1e-9);  // level
    EXPECT_NEAR(centre.z(), 4.1 + 0.1 * v.nav.azimuth_deg / 8, 1e-9);
    EXPECT_EQ(v.pinhole.width, 320);
  }
}

TEST(VirtualViews, OutsideTheHullTheyCanBeRefused) {
  const Rig rig = arc_rig(4, 5);
  RenderRequest request;
  request.name = "far";
  request.line = 7;
  request.options.file = "shot.toml";
  request.keyframes = {{0, 0.1, 0, 0}, {0.1, 0.1, 60, 0}};
  const auto views = virtual_views(request, rig.shot, rig.calibration, rig.navspace);
  refuse_outside(request, views.front(), rig.navspace);
  try {
    refuse_outside(request, views.back(), rig.navspace);
    FAIL() << "60 degrees is no place between the cameras";
  } catch (const Error& e) {
    const std::string text = e.what();
    for (const char* part : {"shot.toml:7", "'far' frame 3", "azimuth 60.0", "-12.0 to 12.0", "clamp"})
      EXPECT_NE(text.find(part), std::string::npos) << text;
  }
}

TEST(VirtualViews, ReadTheFramesAroundTheTimeOfTheCamerasBesideTheCell) {
  const Rig rig = arc_rig(8, 6);
  RenderRequest request = request_of("view");
  request.keyframes = {{0, 0.23, 3, 0}};
  const auto views = virtual_views(request, rig.shot, rig.calibration, rig.navspace);
  ASSERT_EQ(views.size(), 1U);
  std::vector<int> expected;
  for (int c = 1; c <= 6; ++c)
    for (int k : {2, 3}) expected.push_back(6 * c + k);
  EXPECT_EQ(views[0].images, expected);
}

TEST(RenderNeeds, WhatTheFirstViewReadsComesFirst) {
  Rig rig = arc_rig(8, 6);
  RenderRequest late = request_of("view"), early = request_of("view");
  late.keyframes = {{0, 0.43, 20, 0}};
  early.keyframes = {{0, 0.03, -20, 0}};
  rig.shot.renders = {late, early};
  const RenderNeeds needs = render_needs(rig.shot, rig.calibration, rig.navspace);
  const auto views = virtual_views(late, rig.shot, rig.calibration, rig.navspace);
  const std::set<int> first_images(views[0].images.begin(), views[0].images.end());
  const auto edges = by_first_use(needs.edges);
  const auto is_first = [&](const std::pair<int, int>& edge) {
    return first_images.contains(edge.first) && first_images.contains(edge.second);
  };
  EXPECT_TRUE(is_first(edges.front()));
  EXPECT_FALSE(is_first(edges.back()));
  EXPECT_TRUE(std::ranges::is_partitioned(edges, is_first));
  EXPECT_TRUE(std::ranges::is_partitioned(by_first_use(needs.depths), [&](int v) { return first_images.contains(v); }));
  EXPECT_EQ(needs.edges.at(edges.back()), 1U);
  for (const auto& [i, k] : edges) EXPECT_LT(i, k);
}

TEST(VirtualViews, StereoEyesAreParallelAndMeetAtTheCentre) {
  const Rig rig = arc_rig(4, 3);
  RenderRequest request = request_of("stereo");
  request.keyframes = {{0, 0.1, 0, 0}};
  const VirtualView v = virtual_views(request, rig.shot, rig.calibration, rig.navspace).at(0);
  ASSERT_EQ(v.eyes.size(), 2U);
  EXPECT_NEAR((v.eyes[0].cam_from_world.R - v.cam_from_world.R).norm(), 0, 1e-12);
  const Eigen::Vector3d apart = v.eyes[1].cam_from_world.centre() - v.eyes[0].cam_from_world.centre();
  EXPECT_NEAR(v.cam_from_world.R.row(0).dot(apart), v.stereo->rig.baseline, 1e-9);
  const auto pixel = [&](const VirtualEye& eye, const Eigen::Vector3d& p) {
    return eye.pinhole.project(eye.cam_from_world * p);
  };
  EXPECT_NEAR((pixel(v.eyes[0], rig.navspace.centre) - pixel(v.eyes[1], rig.navspace.centre)).norm(), 0, 1e-9);
  const Eigen::Vector3d nearer = 0.5 * v.cam_from_world.centre();
  EXPECT_GT(pixel(v.eyes[0], nearer).x(), pixel(v.eyes[1], nearer).x());
}

TEST(FramePlan, SurvivesJsonAndSharesSumToOne) {
  const Rig rig = arc_rig(4, 4);
  RenderRequest request = request_of("stereo-depth");
  request.keyframes = {{0, 0.13, 2, 0}};
  const VirtualView view = virtual_views(request, rig.shot, rig.calibration, rig.navspace).at(0);
  const FramePlan plan = plan_frame(view, view, request, rig.calibration, rig.navspace, MatchedEdges(rig.navspace));
  const FramePlan again = frame_plan_from(Json::parse(to_json(plan).dump()));
  EXPECT_EQ(to_json(again), to_json(plan));
  for (const PlannedEye& eye : plan.eyes) {
    double mu = 0, share = 0;
    for (std::size_t k = 0; k < plan.images.size(); ++k) {
      mu += eye.mu[k];
      share += eye.share[k];
    }
    EXPECT_NEAR(mu, 1, 1e-9);
    EXPECT_NEAR(share, 1, 1e-9);
    EXPECT_TRUE(eye.disparity.has_value());
  }
}

}  // namespace
}  // namespace vantage
