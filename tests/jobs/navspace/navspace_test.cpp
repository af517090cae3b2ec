#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include "jobs/navspace/build_navspace.h"
#include "jobs/navspace/delaunay.h"
#include "jobs/navspace/sphere_frame.h"
#include "jobs/views/nav_locator.h"
#include "jobs/views/sphere.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

struct Camera {
  double azimuth_deg, elevation_deg, offset_s, fps;
  int num_frames;
};

Navspace space_of(const std::vector<Camera>& cameras) {
  Navspace n;
  for (std::size_t c = 0; c < cameras.size(); ++c)
    for (int k = 0; k < cameras[c].num_frames; ++k)
      n.vertices.push_back({{"cam" + std::to_string(c), k},
                            cameras[c].azimuth_deg,
                            cameras[c].elevation_deg,
                            cameras[c].offset_s + k / cameras[c].fps});
  return n;
}

/// 3 × 3 cameras, slightly off the grid; start_s(camera) and frame rates differ when told so.
std::vector<Camera> grid(bool synchronous, int num_frames) {
  std::vector<Camera> cameras;
  std::mt19937 random(7);
  const auto jitter = [&] { return static_cast<double>(random() % 1000) / 1000 - 0.5; };
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      cameras.push_back({10.0 * column - 10 + jitter(), 8.0 * row - 8 + jitter(), synchronous ? 0 : 0.05 * jitter(),
                         synchronous ? 30.0 : 25 + 10 * jitter(), num_frames});
  return cameras;
}

Eigen::MatrixXd places_of(const Navspace& n, int dimension) {
  Eigen::MatrixXd places(dimension, static_cast<Eigen::Index>(n.vertices.size()));
  for (std::size_t v = 0; v < n.vertices.size(); ++v) {
    const Eigen::Vector3d p(n.vertices[v].azimuth_deg,
                            dimension == 3 ? n.vertices[v].elevation_deg : n.vertices[v].time_s, n.vertices[v].time_s);
    places.col(static_cast<Eigen::Index>(v)) = p.head(dimension);
  }
  return places;
}

double total_volume(const Navspace& n, int dimension) {
  const Eigen::MatrixXd places = places_of(n, dimension);
  double sum = 0;
  for (const auto& s : n.simplices) sum += simplex_volume(places, s);
  return sum;
}

/// Volume of the convex hull, by an independent Delaunay triangulation of all vertices.
double hull_volume(const Navspace& n, int dimension) {
  Eigen::MatrixXd places = places_of(n, dimension);
  places.row(dimension - 1) *= 30;  // seconds beside degrees: any scale gives the same hull
  double sum = 0;
  for (const auto& s : delaunay(places, 0)) sum += simplex_volume(places, s);
  return sum / 30;
}

void expect_conforming(const Navspace& n) {
  std::map<std::vector<int>, int> facets;
  for (const auto& s : n.simplices)
    for (std::size_t drop = 0; drop < s.size(); ++drop) {
      std::vector<int> facet = s;
      facet.erase(facet.begin() + static_cast<std::ptrdiff_t>(drop));
      ++facets[facet];
    }
  for (const auto& [facet, count] : facets) EXPECT_LE(count, 2);
}

double smallest_volume(const Navspace& n, int dimension) {
  const Eigen::MatrixXd places = places_of(n, dimension);
  double smallest = 1e300;
  for (const auto& s : n.simplices) smallest = std::min(smallest, simplex_volume(places, s));
  return smallest;
}

TEST(Navspace, SynchronousCamerasFillTheHullWithoutFlatCells) {
  Navspace n = space_of(grid(true, 12));
  const NavspaceReport report = join_vertices(n, {});
  EXPECT_EQ(report.cells, "columns");
  EXPECT_FALSE(report.arc);
  EXPECT_EQ(report.num_unused, 0U);
  EXPECT_NEAR(total_volume(n, 3) / hull_volume(n, 3), 1, 1e-9);
  EXPECT_GT(smallest_volume(n, 3), 1e-3);
  expect_conforming(n);
}

TEST(Navspace, UnsynchronisedCamerasOfDifferentRatesFillTheHull) {
  Navspace n = space_of(grid(false, 10));
  join_vertices(n, {});
  EXPECT_NEAR(total_volume(n, 3) / hull_volume(n, 3), 1, 0.01);  // flips may leave a rest open
  EXPECT_LE(total_volume(n, 3) / hull_volume(n, 3), 1 + 1e-9);
  expect_conforming(n);
}

TEST(Navspace, EveryPointInsideLiesInExactlyOneCell) {
  Navspace n = space_of(grid(false, 10));
  join_vertices(n, {});
  const Eigen::MatrixXd places = places_of(n, 3);
  std::mt19937 random(3);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  for (int k = 0; k < 500; ++k) {
    const Eigen::Vector3d p(uniform(-8, 8), uniform(-6, 6), uniform(0.05, 0.25));
    int count = 0;
    for (const auto& s : n.simplices) {
      Eigen::Matrix3d edges;
      for (int c = 0; c < 3; ++c) edges.col(c) = places.col(s[static_cast<std::size_t>(c) + 1]) - places.col(s[0]);
      const Eigen::Vector3d w = edges.inverse() * (p - places.col(s[0]));
      count += w.minCoeff() >= 0 && w.sum() <= 1;
    }
    EXPECT_EQ(count, 1);
  }
}

TEST(Navspace, ArcBecomesTrianglesOfAzimuthAndTime) {
  std::vector<Camera> cameras;
  for (int c = 0; c < 8; ++c)
    cameras.push_back({7.0 * c - 24.5, c % 2 == 0 ? 0.4 : -0.4, 0.01 * ((5 * c) % 7), 30, 10});
  Navspace n = space_of(cameras);
  const NavspaceReport report = join_vertices(n, {});
  EXPECT_TRUE(report.arc);
  for (const NavVertex& v : n.vertices) EXPECT_DOUBLE_EQ(v.elevation_deg, n.vertices[0].elevation_deg);
  for (const auto& s : n.simplices) EXPECT_EQ(s.size(), 3U);
  EXPECT_NEAR(total_volume(n, 2) / hull_volume(n, 2), 1, 1e-9);
  EXPECT_EQ(report.num_unused, 0U);
  expect_conforming(n);
}

TEST(Navspace, CellsOfAnArcSpanNoMoreThanOneImageInterval) {
  Navspace n = space_of({{-5, 0, 0, 30, 20}, {5, 0, 0.011, 24, 16}});
  join_vertices(n, {});
  for (const auto& s : n.simplices) {
    std::set<std::string> cameras;
    for (const int v : s) cameras.insert(n.vertices[static_cast<std::size_t>(v)].image.camera);
    EXPECT_EQ(cameras.size(), 2U);
    EXPECT_LE(
        std::abs(n.vertices[static_cast<std::size_t>(s[0])].time_s - n.vertices[static_cast<std::size_t>(s[1])].time_s),
        1 / 23.0);
  }
}

/// Cameras all around, every 30 degrees from -165; elevations may differ by row.
Navspace ring_space(bool level) {
  std::vector<Camera> cameras;
  for (int c = 0; c < 12; ++c)
    cameras.push_back({30.0 * c - 165, level ? 0 : c % 2 == 0 ? 0.0 : 20.0, 0.003 * c, 30, 4});
  return space_of(cameras);
}

TEST(Navspace, RingIsClosedAcrossItsSeam) {
  for (const bool level : {true, false}) {
    Navspace joined = ring_space(level);
    EXPECT_TRUE(join_vertices(joined, {}).ring);
    const TemporaryFolder folder;
    write_navspace(folder.path() / "navspace.json", joined);
    const Navspace n = read_navspace(folder.path());
    const int num_images = 12 * 4;
    for (const auto& [i, k] : n.edges) {
      EXPECT_LT(i, k);
      EXPECT_LT(k, num_images);
    }
    const NavLocator locator(n);
    for (const double azimuth : {-180.0, 180.0, 175.0, 539.0}) {
      const NavLocation at = locator.locate({azimuth, 10, 0.05});
      EXPECT_EQ(at.outside, false) << azimuth;
      std::set<std::string> cameras;
      for (const int v : at.vertices) {
        ASSERT_LT(v, num_images);
        cameras.insert(n.vertices[static_cast<std::size_t>(v)].image.camera);
      }
      EXPECT_TRUE(cameras.contains("cam0") || cameras.contains("cam1")) << azimuth;
      EXPECT_TRUE(cameras.contains("cam11") || cameras.contains("cam10")) << azimuth;
    }
    const NavLocation before = locator.locate({179.9999999, 10, 0.05}),
                      after = locator.locate({-179.9999999, 10, 0.05});
    std::map<int, double> difference;
    for (std::size_t k = 0; k < before.vertices.size(); ++k) difference[before.vertices[k]] += before.weights[k];
    for (std::size_t k = 0; k < after.vertices.size(); ++k) difference[after.vertices[k]] -= after.weights[k];
    for (const auto& [vertex, weight] : difference) EXPECT_NEAR(weight, 0, 1e-6) << vertex;
  }
}

TEST(Navspace, CamerasWithAWideGapAreNoRing) {
  std::vector<Camera> cameras;
  for (int c = 0; c < 11; ++c) cameras.push_back({30.0 * c - 165, 0, 0, 30, 4});  // 60 degrees are missing
  Navspace n = space_of(cameras);
  EXPECT_FALSE(join_vertices(n, {}).ring);
  EXPECT_EQ(n.vertices.size(), 44U);
}

/// Two held cameras of an arc that change places: columns would overlap.
TEST(Navspace, CamerasThatPassEachOtherBecomeDelaunayCells) {
  Navspace n = space_of({{-10, 0, 0, 30, 9}, {0, 0, 0.01, 30, 9}, {10, 0, 0.02, 30, 9}});
  for (NavVertex& v : n.vertices)
    if (v.image.camera == "cam1") v.azimuth_deg = -6 + 3.0 * v.image.frame;  // -6 to 18: past cam2
  const NavspaceReport report = join_vertices(n, {});
  EXPECT_TRUE(report.crossing);
  EXPECT_NEAR(total_volume(n, 2) / hull_volume(n, 2), 1, 1e-9);
}

TEST(Navspace, HeldCamerasThatKeepTheirPlacesStayColumns) {
  Navspace n = space_of({{-10, 0, 0, 30, 9}, {0, 0, 0.01, 30, 9}, {10, 0, 0.02, 30, 9}});
  for (NavVertex& v : n.vertices) v.azimuth_deg += std::sin(v.image.frame + v.azimuth_deg);
  const NavspaceReport report = join_vertices(n, {});
  EXPECT_FALSE(report.crossing);
  EXPECT_EQ(report.cells, "columns");
}

TEST(Navspace, OneMomentOfManyCamerasIsTriangles) {
  Navspace n = space_of(grid(true, 1));
  const NavspaceReport report = join_vertices(n, {});
  EXPECT_TRUE(report.frozen);
  for (const auto& s : n.simplices) EXPECT_EQ(s.size(), 3U);
  EXPECT_EQ(report.num_unused, 0U);
}

TEST(Navspace, OneMomentOfAnUnevenArcIsTriangles) {
  Navspace n = space_of({{10, 0, 0, 1, 1}, {-10, 0.1, 0, 1, 1}, {0, 0, 0, 1, 1}, {20, 0.6, 0, 1, 1}});
  join_vertices(n, {});
  for (const auto& s : n.simplices) EXPECT_EQ(s.size(), 3U);
  EXPECT_EQ(n.simplices.size(), 2U);
}

TEST(Navspace, OneMomentOfALevelArcIsAChain) {
  Navspace n = space_of({{10, 0, 0, 1, 1}, {-10, 0, 0, 1, 1}, {0, 0, 0, 1, 1}});
  join_vertices(n, {});
  EXPECT_EQ(n.simplices, (std::vector<std::vector<int>>{{1, 2}, {0, 2}}));
  EXPECT_EQ(n.edges.size(), 2U);
}

TEST(Navspace, StillsOfDifferentMomentsAreTetrahedra) {
  std::vector<Camera> cameras = grid(true, 1);
  for (std::size_t c = 0; c < cameras.size(); ++c) cameras[c].offset_s = 0.08 * static_cast<double>((c * 4) % 9);
  Navspace n = space_of(cameras);
  const NavspaceReport report = join_vertices(n, {});
  EXPECT_EQ(report.cells, "delaunay");
  EXPECT_NEAR(total_volume(n, 3) / hull_volume(n, 3), 1, 1e-6);
  for (const auto& s : n.simplices) EXPECT_EQ(s.size(), 4U);
}

TEST(Navspace, EdgesAreThoseOfTheCellsEachOnce) {
  Navspace n = space_of(grid(false, 4));
  join_vertices(n, {});
  std::set<std::pair<int, int>> expected;
  for (const auto& s : n.simplices)
    for (std::size_t i = 0; i < s.size(); ++i)
      for (std::size_t k = i + 1; k < s.size(); ++k) expected.emplace(std::min(s[i], s[k]), std::max(s[i], s[k]));
  EXPECT_EQ(std::set(n.edges.begin(), n.edges.end()), expected);
  EXPECT_EQ(n.edges.size(), expected.size());
}

std::vector<std::vector<RigidTransform>> looking_at(const Eigen::Vector3d& target, const Eigen::Vector3d& up,
                                                    double step_deg) {
  std::vector<std::vector<RigidTransform>> poses;
  for (int k = -3; k <= 3; ++k) {
    const double a = k * step_deg * M_PI / 180;
    poses.push_back(
        {look_at(target + Eigen::Vector3d(4 * std::sin(a), -1 - 0.2 * (k % 2), -4 * std::cos(a)), target, up)});
  }
  return poses;
}

TEST(SphereFrame, AxesMeetAtTheCentreAndFrontPointsToTheCameras) {
  const Eigen::Vector3d target(0.3, -0.8, 2), up(0, -1, 0);
  const SphereFrame frame = sphere_frame(looking_at(target, up, 9), {});
  EXPECT_EQ(frame.centre_from, "optical axes");
  EXPECT_NEAR((frame.centre - target).norm(), 0, 1e-9);
  EXPECT_NEAR((frame.axes.row(0).cross(frame.axes.row(1)) - frame.axes.row(2)).norm(), 0, 1e-12);
  EXPECT_LT(frame.axes(2, 2), -0.9);
}

TEST(SphereFrame, ParallelCamerasTakeTheDepthOfTheSparsePoints) {
  std::vector<std::vector<RigidTransform>> poses;
  for (int k = 0; k < 5; ++k) poses.push_back({look_at({0.2 * k, 0, 0}, {0.2 * k, 0, 100}, {0, -1, 0})});
  std::vector<SparsePoint> points(40);
  for (std::size_t k = 0; k < points.size(); ++k)
    points[k].position = {0.1 * static_cast<double>(k % 7), 0.3 * static_cast<double>(k % 5), 6};
  const SphereFrame frame = sphere_frame(poses, points);
  EXPECT_EQ(frame.centre_from, "sparse points");
  EXPECT_NEAR(frame.centre.z(), 6, 1e-9);
}

TEST(SphereFrame, GroundPlaneCorrectsRolledCameras) {
  const Eigen::Vector3d true_up = Eigen::Vector3d(0.12, -1, 0.05).normalized();
  const Eigen::Vector3d u = true_up.unitOrthogonal(), v = true_up.cross(u);
  std::vector<SparsePoint> points;
  std::mt19937 random(5);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0 - 0.5; };
  for (int k = 0; k < 300; ++k) points.push_back({.position = 4 * uniform() * u + 4 * uniform() * v, .seen_in = {}});
  for (int k = 0; k < 300; ++k)
    points.push_back({.position = Eigen::Vector3d(2 * uniform(), -1 + uniform(), 2 * uniform()), .seen_in = {}});
  const SphereFrame frame = sphere_frame(looking_at({0, -1, 0}, {0, -1, 0}, 9), points);
  EXPECT_EQ(frame.up_from, "ground plane");
  EXPECT_GT(frame.axes.row(1).dot(true_up), std::cos(0.5 * M_PI / 180));
}

}  // namespace
}  // namespace vantage
