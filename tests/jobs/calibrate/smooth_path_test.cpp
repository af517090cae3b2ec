#include "jobs/calibrate/smooth_path.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "tests/support/synthetic_scene.h"

namespace vantage {
namespace {

constexpr int kNumFrames = 120;

struct Path {
  std::vector<double> times_s;
  std::vector<RigidTransform> truth;
  std::vector<MeasuredPose> measured;
};

/// A held camera's true path and what noisy frames say of it: noise_m of shift and a tenth of that in radians.
Path noisy_path(double sway_m, double sway_deg, double noise_m) {
  synthetic::SceneCamera camera = synthetic::arc_cameras(3, kNumFrames, 320, 180)[1];
  camera.sway_m = sway_m, camera.sway_deg = sway_deg;
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 1);
  Path out;
  for (int k = 0; k < kNumFrames; ++k) {
    const RigidTransform truth = camera.pose(k);
    MeasuredPose measured;
    const Eigen::Vector3d turn = 0.1 * noise_m * Eigen::Vector3d(normal(random), normal(random), normal(random));
    const Eigen::Matrix3d by = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    measured.cam_from_world.R = by * truth.R;
    measured.cam_from_world.t =
        by * truth.t + noise_m * Eigen::Vector3d(normal(random), normal(random), normal(random));
    measured.information.diagonal() << Eigen::Vector3d::Constant(100 / (noise_m * noise_m)),
        Eigen::Vector3d::Constant(1 / (noise_m * noise_m));
    out.times_s.push_back(k / 30.0);
    out.truth.push_back(truth);
    out.measured.push_back(measured);
  }
  return out;
}

/// Root mean square distance of centres from the truth.
double error_m(const Path& path) {
  double sum = 0;
  for (std::size_t k = 0; k < path.truth.size(); ++k)
    sum += (path.measured[k].cam_from_world.centre() - path.truth[k].centre()).squaredNorm();
  return std::sqrt(sum / static_cast<double>(path.truth.size()));
}

TEST(SmoothPath, TakesNoiseOffASlowHand) {
  Path path = noisy_path(0.05, 0.2, 0.01);
  const double before = error_m(path);
  smooth_path(path.times_s, path.measured);
  EXPECT_LT(error_m(path), 0.65 * before);
}

TEST(SmoothPath, LeavesATremorThatIsMeasuredWell) {
  Path path = noisy_path(0.5, 3, 0.001);
  const double before = error_m(path);
  smooth_path(path.times_s, path.measured);
  EXPECT_LT(error_m(path), 1.02 * before);
}

TEST(SmoothPath, BringsATripodToRest) {
  Path path = noisy_path(0, 0, 0.01);
  const double before = error_m(path);
  smooth_path(path.times_s, path.measured);
  EXPECT_LT(error_m(path), 0.45 * before);
}

TEST(SmoothPath, CarriesTheMotionOverFramesWithoutMeasurement) {
  Path path = noisy_path(0.2, 1, 0.0005);
  const auto at = [&](std::size_t k) {
    return (path.measured[k].cam_from_world.centre() - path.truth[k].centre()).norm();
  };
  for (std::size_t k = 50; k < 52; ++k) {  // held where it was before
    path.measured[k].cam_from_world = path.measured[49].cam_from_world;
    path.measured[k].information.setZero();
  }
  const double before = at(51);
  smooth_path(path.times_s, path.measured);
  EXPECT_LT(at(51), 0.5 * before);
}

}  // namespace
}  // namespace vantage
