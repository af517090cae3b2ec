#pragma once
#include <ceres/problem.h>

#include <array>
#include <memory>

#include "jobs/align/joint_path.h"

namespace vantage::align {

/// Standard deviations in px: of a moving point's samples, of the constant by which a track is off its point (tracks of
/// two cameras are seldom on the very same surface point), of the background's sights.
struct JointNoise {
  double sample_px = 0.5, bias_px = 1, still_px = 0.5;
};

/// All that the adjustment changes, as blocks.
struct JointState {
  struct Camera {
    std::array<double, 2> clock{};  ///< shot time of the footage's middle, rate
    std::array<double, 6> pose{};   ///< angle-axis, translation: cam from world
    double focal = 1;               ///< fx
  };
  std::vector<Camera> cameras;
  std::vector<MovingPath> paths;                     ///< of scene.moving
  std::vector<std::vector<Eigen::Vector2d>> biases;  ///< of their tracks
  std::vector<Eigen::Vector3d> still;                ///< of scene.still
};

/// paths: of scene.moving, in the cameras as they are in the scene.
JointState start_state(const JointScene& scene, std::vector<MovingPath> paths);
/// The camera as the state has it.
JointCamera camera_of(const JointScene& scene, const JointState& state, std::size_t camera);
/// Distances between seen and expected px of a moving point's samples, without what its tracks' biases explain.
std::vector<Eigen::Vector2d> errors_px(const JointScene& scene, const JointState& state, std::size_t moving);

/// A least squares problem over a state's blocks, and which residuals belong to which point.
struct JointProblem {
  std::unique_ptr<ceres::Problem> problem;
  std::vector<std::vector<ceres::ResidualBlockId>> moving, still;  ///< by point
  std::vector<ceres::ResidualBlockId> priors;                      ///< of the cameras
};

/// Cauchy's loss over samples, sights and biases; weak priors: clocks within ten frames of the scene's and as steady as
/// crystals are. hold_cameras: only points move. Else clocks do, but for the reference's, and poses and focal lengths
/// unless they are known; the world's place and size are held by the first camera and by one coordinate of the one
/// farthest from it. state must outlive the problem and not be resized.
JointProblem build_problem(const JointScene& scene, JointState& state, const JointNoise& noise, bool hold_cameras);

}  // namespace vantage::align
