#include "jobs/reconstruct/refine.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numeric>

namespace vantage {
namespace {

/// Smooth texture on a plane, in world units.
double texture_at(double x, double y) {
  return 128 + 35 * std::sin(23 * x + 3 * std::cos(11 * y)) + 30 * std::cos(19 * y - 2 * std::sin(17 * x)) +
         15 * std::sin(31 * (x + y));
}

/// A tilted plane z = z0 + 0.3 x - 0.2 y that moves as a whole, filmed by cameras side by side, two frames each.
struct MovingPlane {
  Eigen::Vector3d through{0, 0, 3}, normal = Eigen::Vector3d(0.3, -0.2, -1).normalized(), velocity{0.4, -0.2, 0.3};
  ViewGroup group;

  explicit MovingPlane(const Eigen::Vector3d& v) : velocity(v) {
    std::vector<GroupImage> images;
    for (int c = 0; c < 5; ++c)
      for (int f = 0; f < 2; ++f) images.push_back(image(c, f));
    group = make_view_group(images, 0);
  }
  GroupImage image(int camera, int frame) const {
    GroupImage out{.id = {"cam" + std::to_string(camera), frame},
                   .time_s = 0.1 * frame + 0.013 * camera,
                   .pinhole = {160, 120, 180, 180, 80, 60},
                   .cam_from_world = {},
                   .bgr = cv::Mat3b(120, 160)};
    const double angle = 0.12 * (camera - 2);
    out.cam_from_world.R = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
    const Eigen::Vector3d centre(3 * std::sin(angle), 0.1 * (camera % 2), 3 - 3 * std::cos(angle));
    out.cam_from_world.t = -out.cam_from_world.R * centre;
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 160; ++x) {
        const Eigen::Vector3d ray = out.cam_from_world.R.transpose() * out.pinhole.ray({x + 0.5, y + 0.5});
        const Eigen::Vector3d moved = through + out.time_s * velocity;
        const Eigen::Vector3d at =
            centre + ray * (normal.dot(moved - centre) / normal.dot(ray)) - out.time_s * velocity;
        const auto grey = cv::saturate_cast<uchar>(texture_at(at.x(), at.y()));
        out.bgr(y, x) = {grey, grey, grey};
      }
    return out;
  }
  /// The plane as its middle camera's first view sees it, through a pixel.
  TangentPlane truth(const Eigen::Vector2d& px) const {
    constexpr int kReference = 4;
    const View& view = group.view(kReference);
    const Eigen::Vector3d ray = world_ray(view, px),
                          moved = through + (view.time_s + group.reference_time_s) * velocity;
    const Eigen::Vector3d point = view.centre + ray * (normal.dot(moved - view.centre) / normal.dot(ray));
    return *tangent_plane(group, kReference, point, normal, velocity);
  }
  std::vector<int> others() const {
    std::vector<int> views(10);
    std::iota(views.begin(), views.end(), 0);
    std::erase(views, 4);
    return views;
  }
};

const Eigen::Vector2d kPixel(85.5, 58.5);

/// Truth with a wrong depth (2 %), a normal towards the camera, and 15 % of the velocity missing.
TangentPlane disturbed(const MovingPlane& scene) {
  const TangentPlane truth = scene.truth(kPixel);
  const View& view = scene.group.view(truth.reference);
  const Eigen::Vector3d point = view.centre + world_ray(view, kPixel) / truth.inverse_depth * 1.02;
  return *tangent_plane(scene.group, truth.reference, point, (view.centre - point).normalized(), 0.85 * truth.velocity);
}

void expect_truth(const MovingPlane& scene, const TangentPlane& found, double depth_share, double normal_deg,
                  double velocity_share) {
  const TangentPlane truth = scene.truth(kPixel);
  EXPECT_NEAR(truth.inverse_depth / found.inverse_depth, 1, depth_share);
  EXPECT_LT(std::acos(std::min(1.0, normal_of(scene.group, found).dot(scene.normal))) * 57.3, normal_deg);
  EXPECT_LT((found.velocity - scene.velocity).norm(), velocity_share * std::max(0.1, scene.velocity.norm()));
}

TEST(TangentPlaneTest, KeepsPointAndNormal) {
  const MovingPlane scene({0.4, -0.2, 0.3});
  const TangentPlane plane = scene.truth(kPixel);
  EXPECT_LT((plane.px - kPixel).norm(), 1e-9);
  EXPECT_GT(normal_of(scene.group, plane).dot(scene.normal), 1 - 1e-12);
  const Eigen::Vector3d centre = centre_at_reference_time(scene.group, plane);
  EXPECT_LT((project(scene.group.view(plane.reference), centre).px - kPixel).norm(), 1e-9);
}

TEST(TangentPlaneTest, EdgeOnPlanesAreRefused) {
  const MovingPlane scene(Eigen::Vector3d::Zero());
  EXPECT_FALSE(tangent_plane(scene.group, 4, {0, 0, 3}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::Zero()));
}

TEST(PhotoCostTest, IsNearZeroAtTheTruthOnly) {
  const MovingPlane scene({0.4, -0.2, 0.3});
  const auto texture = ReferenceTexture::sample(scene.group, 4, kPixel);
  ASSERT_TRUE(texture);
  EXPECT_LT(photo_cost(*texture, scene.truth(kPixel), scene.others(), false).value, 0.01);
  EXPECT_GT(photo_cost(*texture, disturbed(scene), scene.others(), false).value, 0.03);
}

TEST(PhotoCostTest, GradientIsThatOfFiniteDifferences) {
  const MovingPlane scene({0.4, -0.2, 0.3});
  const auto texture = ReferenceTexture::sample(scene.group, 4, kPixel);
  const TangentPlane at = disturbed(scene);
  const PhotoCost cost = photo_cost(*texture, at, scene.others(), true);
  for (int i = 0; i < 6; ++i) {
    const double h = 1e-4 / std::sqrt(cost.hessian(i, i));
    Vector6d up = parameters(at), down = up;
    up(i) += h;
    down(i) -= h;
    const double slope = (photo_cost(*texture, with_parameters(at, up), scene.others(), false).value -
                          photo_cost(*texture, with_parameters(at, down), scene.others(), false).value) /
                         (2 * h);
    EXPECT_NEAR(slope, cost.gradient(i), 0.02 * std::abs(slope) + 0.003 / h * 1e-4) << "parameter " << i;
  }
}

TEST(ReferenceTextureTest, FlatAreasAndBordersAreRefused) {
  MovingPlane scene(Eigen::Vector3d::Zero());
  EXPECT_FALSE(ReferenceTexture::sample(scene.group, 4, {2, 50}));
  scene.group.views[4].grey.setTo(90.0F);
  EXPECT_FALSE(ReferenceTexture::sample(scene.group, 4, kPixel));
}

TEST(Refine, FindsPlaneAndVelocity) {
  const MovingPlane scene({0.4, -0.2, 0.3});
  const auto texture = ReferenceTexture::sample(scene.group, 4, kPixel);
  const Refinement r = refine(*texture, disturbed(scene), scene.others(), {.max_iterations = 30});
  expect_truth(scene, r.plane, 0.003, 6, 0.05);
}

TEST(Refine, StaticPointsKeepTheirVelocity) {
  const MovingPlane scene(Eigen::Vector3d::Zero());
  const auto texture = ReferenceTexture::sample(scene.group, 4, kPixel);
  const Refinement r =
      refine(*texture, disturbed(scene), scene.others(), {.with_velocity = false, .max_iterations = 30});
  EXPECT_TRUE(r.plane.velocity.isZero());
  expect_truth(scene, r.plane, 0.003, 6, 0.01);
}

TEST(Refine, ThePapersConjugateGradientsAndLbfgsFindTheSameOptimum) {
  const MovingPlane scene({0.4, -0.2, 0.3});
  const auto texture = ReferenceTexture::sample(scene.group, 4, kPixel);
  const Refinement lm = refine(*texture, disturbed(scene), scene.others(), {.max_iterations = 30});
  for (const Optimizer optimizer : {Optimizer::nonlinear_conjugate_gradient, Optimizer::lbfgs}) {
    const Refinement r =
        refine(*texture, disturbed(scene), scene.others(), {.optimizer = optimizer, .max_iterations = 30});
    EXPECT_NEAR(r.cost, lm.cost, 0.002);
    expect_truth(scene, r.plane, 0.005, 8, 0.08);
  }
}

}  // namespace
}  // namespace vantage
