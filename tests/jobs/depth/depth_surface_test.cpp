#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "jobs/depth/depth_mesh.h"
#include "jobs/depth/depth_points.h"
#include "tests/support/synthetic_scene.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

constexpr double kTime_s = 0.3;

/// Exact depth maps of an arc of cameras.
std::vector<PosedDepth> exact_depths(const synthetic::Scene& scene) {
  std::vector<PosedDepth> images;
  for (const synthetic::SceneCamera& c : synthetic::arc_cameras(3, 1, 120, 68)) {
    const synthetic::Picture picture = scene.render(c.pinhole, c.cam_from_world, kTime_s);
    images.push_back({c.pinhole,
                      c.cam_from_world,
                      {picture.depth.clone(), cv::Mat1f(picture.depth.size(), 1.0F)},
                      picture.bgr.clone()});
  }
  return images;
}

class DepthSurface : public testing::Test {
 protected:
  synthetic::Scene scene_;
  std::vector<PosedDepth> images_ = exact_depths(scene_);
};

TEST_F(DepthSurface, PointsLieOnTheSceneAndFaceTheCameras) {
  const auto points = consistent_points(images_, {});
  ASSERT_GT(points.size(), images_[0].depth.z.total() / 2);
  std::size_t far = 0, turned = 0;
  for (const Patch& p : points) {
    far += scene_.distance_to_surface(p.position.cast<double>(), kTime_s) > 0.02;
    turned += (images_[1].cam_from_world.centre().cast<float>() - p.position).dot(p.normal) < 0;
  }
  EXPECT_LT(far, points.size() / 100);
  EXPECT_LT(turned, points.size() / 50);
}

TEST_F(DepthSurface, ASurfaceSeenByAllGivesNotAllOfTheirPixels) {
  const auto all = consistent_points(images_, {});
  EXPECT_LT(all.size(), images_[0].depth.z.total() * 9 / 5);
}

TEST_F(DepthSurface, WhatOneCameraAloneSaysIsLeftOut) {
  images_[1].depth.z(cv::Rect(40, 20, 20, 20)) *= 0.6F;
  for (const Patch& p : consistent_points(images_, {}))
    EXPECT_LT(scene_.distance_to_surface(p.position.cast<double>(), kTime_s), 0.5);
  images_.resize(1);
  EXPECT_TRUE(consistent_points(images_, {}).empty());
}

TEST_F(DepthSurface, DoubtfulDepthIsLeftOut) {
  for (PosedDepth& image : images_) image.depth.confidence.setTo(0.1F);
  EXPECT_TRUE(consistent_points(images_, {}).empty());
  EXPECT_TRUE(mesh_of_depth(images_[0], 0.2F).triangles.empty());
}

TEST(NormalInCam, OfASlantedPlaneIsExact) {
  const Pinhole pinhole{80, 60, 70, 70, 40, 30};
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, -0.4, -1).normalized();
  cv::Mat1f z(60, 80);
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 80; ++x)
      z(y, x) = static_cast<float>(normal.z() * 3 / normal.dot(pinhole.ray({x + 0.5, y + 0.5})));
  EXPECT_LT((normal_in_cam(pinhole, z, 33, 21).cast<double>() - normal).norm(), 1e-3);
}

/// A near square before a wall.
PosedDepth square_before_wall() {
  PosedDepth image{{40, 30, 40, 40, 20, 15}, {}, {cv::Mat1f(30, 40, 4.0F), cv::Mat1f(30, 40, 1.0F)}, {}};
  image.depth.z(cv::Rect(10, 10, 10, 10)).setTo(2);
  image.bgr = cv::Mat3b(30, 40, cv::Vec3b(10, 20, 30));
  return image;
}

TEST(DepthMesh, IsTornWhereDepthSteps) {
  const DepthMesh mesh = mesh_of_depth(square_before_wall(), 0.2F);
  EXPECT_GT(mesh.triangles.size(), 2000U);
  for (const auto& t : mesh.triangles)
    for (const int k : {1, 2})
      EXPECT_NEAR(mesh.vertices[static_cast<std::size_t>(t[0])].z(),
                  mesh.vertices[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])].z(), 1e-5);
}

TEST(DepthMesh, TrianglesFaceTheCamera) {
  const DepthMesh mesh = mesh_of_depth(square_before_wall(), 0.2F);
  for (const auto& t : mesh.triangles) {
    const auto at = [&](int k) { return mesh.vertices[static_cast<std::size_t>(t[static_cast<std::size_t>(k)])]; };
    EXPECT_LT((at(1) - at(0)).cross(at(2) - at(0)).dot(at(0)), 0);
  }
}

TEST(DepthMesh, FilesSayWhatIsInThem) {
  const TemporaryFolder folder;
  const PosedDepth image = square_before_wall();
  const DepthMesh mesh = mesh_of_depth(image, 0.2F);
  write_mesh_ply(folder.path() / "m.ply", mesh, image.bgr);
  const std::size_t header_bytes = 300, body_bytes = mesh.vertices.size() * 15 + mesh.triangles.size() * 13;
  EXPECT_GT(std::filesystem::file_size(folder.path() / "m.ply"), body_bytes);
  EXPECT_LT(std::filesystem::file_size(folder.path() / "m.ply"), body_bytes + header_bytes);

  write_mesh_obj(folder.path() / "m.obj", mesh, image.bgr);
  std::ifstream in(folder.path() / "m.obj");
  std::size_t vertices = 0, texels = 0, faces = 0;
  for (std::string line; std::getline(in, line);) {
    vertices += line.starts_with("v ");
    texels += line.starts_with("vt ");
    faces += line.starts_with("f ");
  }
  EXPECT_EQ(vertices, mesh.vertices.size());
  EXPECT_EQ(texels, mesh.vertices.size());
  EXPECT_EQ(faces, mesh.triangles.size());
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "m.png"));
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "m.mtl"));
}

}  // namespace
}  // namespace vantage
