#include "jobs/vision/epipolar.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace vantage {
namespace {

struct Rig {
  Pinhole pinhole_a{640, 360, 500, 510, 322, 178}, pinhole_b{800, 600, 620, 600, 395, 305};
  RigidTransform a, b;
  Rig() {
    a.R = Eigen::AngleAxisd(0.2, Eigen::Vector3d(0.3, 1, 0.1).normalized()).toRotationMatrix();
    a.t = {0.4, -0.1, 0.3};
    b.R = Eigen::AngleAxisd(0.05, Eigen::Vector3d(0, 1, 0.2).normalized()).toRotationMatrix();
    b.t = {-0.3, 0.05, 0.2};
  }
  TwoView views() const { return {pinhole_a, a, pinhole_b, b}; }
};

TEST(TwoView, ProjectsPointsAsTheCamerasDo) {
  const Rig rig;
  const Eigen::Vector3d world(0.5, -0.2, 4);
  const Eigen::Vector3d in_a = rig.a * world, in_b = rig.b * world;
  const auto px = rig.views().project(rig.pinhole_a.project(in_a), 1 / in_a.z());
  ASSERT_TRUE(px);
  EXPECT_LT((*px - rig.pinhole_b.project(in_b)).norm(), 1e-9);
}

TEST(TwoView, PixelsPerInverseDepthIsTheDerivative) {
  const TwoView views = Rig().views();
  const Eigen::Vector2d px(100, 250);
  const double w = 0.3, h = 1e-6;
  const double difference = (*views.project(px, w + h) - *views.project(px, w - h)).norm() / (2 * h);
  EXPECT_NEAR(views.px_per_inverse_depth(px, w), difference, 1e-4);
}

TEST(FitInverseDepth, FindsDepthAndDistanceFromTheEpipolarLine) {
  const TwoView views = Rig().views();
  const Eigen::Vector2d px(300, 120);
  const Eigen::Vector2d end = *views.project(px, 0.25), along = *views.project(px, 0.26) - end;
  const Eigen::Vector2d aside = Eigen::Vector2d(-along.y(), along.x()).normalized();
  const auto exact = fit_inverse_depth(views, px, end), off = fit_inverse_depth(views, px, end + 2 * aside);
  ASSERT_TRUE(exact && off);
  EXPECT_NEAR(exact->inverse_depth, 0.25, 1e-9);
  EXPECT_LT(exact->residual_px, 1e-9);
  EXPECT_NEAR(off->residual_px, 2, 0.02);
}

TEST(FitInverseDepth, EmptyWithoutParallax) {
  const Rig rig;
  const TwoView same(rig.pinhole_a, rig.a, rig.pinhole_a, rig.a);
  EXPECT_FALSE(fit_inverse_depth(same, {10, 10}, {12, 10}));
}

}  // namespace
}  // namespace vantage
