#include "jobs/reconstruct/reconstruct_group.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/synthetic_scene.h"

namespace vantage {
namespace {

/// 5 cameras, 3 frames each, on the exact scene.
const ViewGroup& scene_group() {
  static const ViewGroup group = [] {
    const synthetic::Scene scene;
    std::vector<GroupImage> images;
    for (const auto& camera : synthetic::arc_cameras(5, 3, 240, 135))
      for (int f = 0; f < 3; ++f)
        images.push_back({{camera.name, f},
                          camera.time_s(f),
                          camera.pinhole,
                          camera.cam_from_world,
                          scene.render(camera.pinhole, camera.cam_from_world, camera.time_s(f)).bgr});
    return make_view_group(images, 0);
  }();
  return group;
}

const Reconstruction& scene_model() {
  static const Reconstruction model = reconstruct_group(scene_group(), {}, [](double, const std::string&) {});
  return model;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Object whose surface a patch lies on, by the picture that a camera would take then; -1 near outlines and off
/// surfaces.
int id_of(const synthetic::Scene& scene, const synthetic::SceneCamera& camera, const Patch& patch, float time_s) {
  const auto& pinhole = camera.pinhole;
  const static synthetic::Picture picture = scene.render(pinhole, camera.cam_from_world, static_cast<double>(time_s));
  const Eigen::Vector3d p = camera.cam_from_world * patch.position_at(time_s).cast<double>();
  const Eigen::Vector2d px = pinhole.project(p);
  const int x = static_cast<int>(px.x()), y = static_cast<int>(px.y());
  if (x < 2 || y < 2 || x >= pinhole.width - 2 || y >= pinhole.height - 2) return -1;
  for (int dy = -2; dy <= 2; ++dy)  // clear of outlines, where a small error changes the object
    for (int dx = -2; dx <= 2; ++dx)
      if (picture.id(y + dy, x + dx) != picture.id(y, x)) return -1;
  return std::abs(static_cast<double>(picture.depth(y, x)) - p.z()) < 0.05 ? picture.id(y, x) : -1;
}

TEST(ReconstructGroup, CoversTheScene) {
  const Reconstruction& model = scene_model();
  EXPECT_GE(model.report.num_seeds, 20);
  EXPECT_GE(model.patches.size(), 3000U);
  EXPECT_EQ(model.report.num_patches, static_cast<int>(model.patches.size()));
}

TEST(ReconstructGroup, PatchesLieOnTheSurface) {
  const synthetic::Scene scene;
  std::vector<double> distances;
  for (const Patch& p : scene_model().patches)
    distances.push_back(
        scene.distance_to_surface(p.position_at((p.t0_s + p.t1_s) / 2).cast<double>(), (p.t0_s + p.t1_s) / 2));
  // A pixel is about 17 mm wide.
  EXPECT_LT(median(distances), 0.012);
  const auto far = std::count_if(distances.begin(), distances.end(), [](double d) { return d > 0.06; });
  EXPECT_LT(static_cast<double>(far), 0.05 * static_cast<double>(distances.size()));
}

TEST(ReconstructGroup, MovingThingsHaveTheirVelocityAndStaticOnesNone) {
  const synthetic::Scene scene;
  const auto camera = synthetic::arc_cameras(5, 3, 240, 135)[2];
  const auto time_s = static_cast<float>(scene_group().reference_time_s);  // motion is linear about the middle
  std::vector<double> moving, still;
  for (const Patch& p : scene_model().patches) {
    const int id = id_of(scene, camera, p, time_s);
    if (id < 0) continue;
    const Eigen::Vector3d v = id >= synthetic::kFirstMovingId ? scene.velocity(id, p.position_at(time_s).cast<double>(),
                                                                               static_cast<double>(time_s))
                                                              : Eigen::Vector3d::Zero();
    if (v.norm() > 0.5) moving.push_back((p.velocity.cast<double>() - v).norm() / v.norm());
    if (id < synthetic::kFirstMovingId) still.push_back(static_cast<double>(p.velocity.norm()));
  }
  ASSERT_GE(moving.size(), 30U);
  EXPECT_LT(median(moving), 0.15);
  ASSERT_GE(still.size(), 500U);
  const auto false_motion = std::count_if(still.begin(), still.end(), [](double v) { return v > 0.1; });
  EXPECT_LT(static_cast<double>(false_motion), 0.02 * static_cast<double>(still.size()));
}

TEST(ReconstructGroup, PatchesAreValidOverTheGroupAndFaceACamera) {
  for (const Patch& p : scene_model().patches) {
    EXPECT_EQ(p.t0_s, static_cast<float>(scene_group().first_s));
    EXPECT_EQ(p.t1_s, static_cast<float>(scene_group().last_s));
    EXPECT_NEAR(p.normal.norm(), 1, 1e-4);
    EXPECT_GE(p.num_views, 3);
    bool faces = false;
    for (const View& v : scene_group().views)
      faces |= p.normal.dot((v.centre - p.position.cast<double>()).cast<float>()) > 0;
    EXPECT_TRUE(faces);
  }
}

TEST(ReconstructGroup, SameInputSamePatches) {
  ReconstructOptions small;
  small.expansion.max_patches = 800;
  const auto a = reconstruct_group(scene_group(), small, [](double, const std::string&) {});
  const auto b = reconstruct_group(scene_group(), small, [](double, const std::string&) {});
  ASSERT_EQ(a.patches.size(), b.patches.size());
  for (std::size_t i = 0; i < a.patches.size(); ++i) {
    EXPECT_EQ(a.patches[i].position, b.patches[i].position);
    EXPECT_EQ(a.patches[i].velocity, b.patches[i].velocity);
  }
}

TEST(ReconstructGroup, TwoImagesAreTooFew) {
  ViewGroup two = scene_group();
  two.views.resize(2);
  EXPECT_TRUE(reconstruct_group(two, {}, [](double, const std::string&) {}).patches.empty());
}

TEST(ReconstructGroup, FlatImagesGiveNothing) {
  ViewGroup flat = scene_group();
  for (View& v : flat.views) v.grey = cv::Mat1f(v.grey.size(), 128.0F);
  EXPECT_TRUE(reconstruct_group(flat, {}, [](double, const std::string&) {}).patches.empty());
}

}  // namespace
}  // namespace vantage
