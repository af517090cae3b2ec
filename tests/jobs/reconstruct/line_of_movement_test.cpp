#include "jobs/reconstruct/line_of_movement.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace vantage {
namespace {

constexpr double kFocal = 500;

/// A ray from a camera on an arc of radius 5 to a point; noise_px disturbs its direction.
RayObservation ray_to(const Eigen::Vector3d& point, int camera, double time_s, double noise_px, std::mt19937& random) {
  const double azimuth = 0.2 * camera;
  RayObservation ray{.origin = {5 * std::sin(azimuth), 0.3 * (camera % 2), -5 * std::cos(azimuth)},
                     .time_s = time_s,
                     .camera = camera,
                     .focal_px = kFocal};
  std::normal_distribution<double> noise(0, noise_px / kFocal);
  const Eigen::Vector3d to = (point - ray.origin).normalized();
  ray.direction = (to + Eigen::Vector3d(noise(random), noise(random), noise(random))).normalized();
  return ray;
}

const Eigen::Vector3d kPosition(0.3, -0.2, 0.5), kVelocity(0.8, -0.5, 0.3);

/// Rays of num_cameras x num_frames, unsynchronised by fractions of a frame, to a point that moves.
std::vector<RayObservation> rays(int num_cameras, int num_frames, const Eigen::Vector3d& velocity, double noise_px,
                                 unsigned seed = 1) {
  std::mt19937 random(seed);
  std::vector<RayObservation> out;
  for (int c = 0; c < num_cameras; ++c)
    for (int f = 0; f < num_frames; ++f) {
      const double t = f / 30.0 + 0.011 * c - 0.05;
      out.push_back(ray_to(kPosition + t * velocity, c, t, noise_px, random));
    }
  return out;
}

/// Eq. 8 word for word: unknowns c, v and a depth per ray; the least-squares solution by singular value decomposition.
Eigen::Matrix<double, 6, 1> solve_equation_8(const std::vector<RayObservation>& rays) {
  const auto n = static_cast<Eigen::Index>(rays.size());
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(3 * n, 6 + n);
  Eigen::VectorXd b(3 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& ray = rays[static_cast<std::size_t>(i)];
    A.block<3, 3>(3 * i, 0).setIdentity();
    A.block<3, 3>(3 * i, 3) = ray.time_s * Eigen::Matrix3d::Identity();
    A.block<3, 1>(3 * i, 6 + i) = -ray.direction;
    b.segment<3>(3 * i) = ray.origin;
  }
  return A.bdcSvd(Eigen::ComputeThinU | Eigen::ComputeThinV).solve(b).head<6>();
}

TEST(LineOfMovement, RecoversExactRaysExactly) {
  const auto line = solve_moving(rays(4, 3, kVelocity, 0));
  ASSERT_TRUE(line);
  EXPECT_LT((line->position - kPosition).norm(), 1e-9);
  EXPECT_LT((line->velocity - kVelocity).norm(), 1e-8);
  EXPECT_LT(line->rms_px, 1e-6);
}

TEST(LineOfMovement, AgreesWithTheLiteralSingularValueDecompositionOfEquation8) {
  const auto exact = rays(5, 3, kVelocity, 0);
  const auto literal = solve_equation_8(exact);
  const auto line = solve_moving(exact);
  ASSERT_TRUE(line);
  EXPECT_LT((line->position - literal.head<3>()).norm(), 1e-9);
  EXPECT_LT((line->velocity - literal.tail<3>()).norm(), 1e-8);
  // With noise the two differ by the weights only: Eq. 8 counts world units, the normal equations pixels.
  const auto noisy = rays(5, 3, kVelocity, 0.3);
  const auto weighted = solve_moving(noisy);
  const auto plain = solve_equation_8(noisy);
  ASSERT_TRUE(weighted);
  EXPECT_LT((weighted->position - plain.head<3>()).norm(), 0.2 * weighted->sigma_position);
  EXPECT_LT((weighted->velocity - plain.tail<3>()).norm(), 0.2 * weighted->sigma_velocity);
}

TEST(LineOfMovement, ErrorsStayWithinThePredictedSigma) {
  int within = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    const auto line = solve_moving(rays(5, 3, kVelocity, 0.3, seed));
    ASSERT_TRUE(line);
    within += (line->velocity - kVelocity).norm() < 3 * 0.3 * line->sigma_velocity;
  }
  EXPECT_GE(within, 47);
}

TEST(LineOfMovement, OneStaticCameraIsDegenerate) {
  EXPECT_FALSE(solve_moving(rays(1, 8, kVelocity, 0)));
  EXPECT_FALSE(solve_static(rays(1, 8, Eigen::Vector3d::Zero(), 0)));
}

TEST(LineOfMovement, OneMomentIsDegenerateForMotionButNotForPosition) {
  auto still = rays(4, 1, Eigen::Vector3d::Zero(), 0);
  for (auto& ray : still) ray.time_s = 0.1;
  EXPECT_FALSE(solve_moving(still));
  const auto line = solve_static(still);
  ASSERT_TRUE(line);
  EXPECT_LT((line->position - kPosition).norm(), 1e-9);
}

TEST(LineOfMovement, ThreeCamerasWithOneFrameEachFallBackToStatic) {
  const auto line = fit_line_of_movement(rays(3, 1, Eigen::Vector3d::Zero(), 0.2), {}, 1);
  ASSERT_TRUE(line);
  EXPECT_FALSE(line->moves);
  EXPECT_TRUE(line->velocity.isZero());
  EXPECT_LT((line->position - kPosition).norm(), 0.03);
}

TEST(LineOfMovement, StaticPointsStayStaticAndMovingOnesMove) {
  int wrong = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    const auto still = fit_line_of_movement(rays(5, 4, Eigen::Vector3d::Zero(), 0.4, seed), {}, seed);
    const auto moving = fit_line_of_movement(rays(5, 4, kVelocity, 0.4, seed), {}, seed);
    ASSERT_TRUE(still && moving);
    wrong += still->moves + !moving->moves;
  }
  EXPECT_LE(wrong, 2);
}

TEST(LineOfMovement, WrongRaysAreLeftOut) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    auto all = rays(6, 3, kVelocity, 0.1, seed);
    std::mt19937 random(seed);
    for (const std::size_t wrong : {1U, 7U, 12U, 16U})
      all[wrong] = ray_to(Eigen::Vector3d(-0.4, 0.5, 0.1 * static_cast<double>(wrong)), all[wrong].camera,
                          all[wrong].time_s, 0, random);
    const auto line = fit_line_of_movement(all, {}, seed);
    ASSERT_TRUE(line);
    EXPECT_TRUE(line->moves);
    EXPECT_EQ(line->inliers.size(), 14U);
    EXPECT_LT((line->velocity - kVelocity).norm(), 0.1);
  }
}

TEST(LineOfMovement, PointsBehindACameraAreNoInliers) {
  LineOfMovement behind;
  behind.position = {0, 0, -9};
  const RayObservation ray{.origin = {0, 0, -5}, .direction = {0, 0, 1}, .focal_px = kFocal};
  EXPECT_TRUE(std::isinf(reprojection_error_px(behind, ray)));
}

TEST(LineOfMovement, SetsOfOneCameraGiveNothing) {
  EXPECT_FALSE(fit_line_of_movement(rays(1, 6, kVelocity, 0), {}, 1));
}

}  // namespace
}  // namespace vantage
