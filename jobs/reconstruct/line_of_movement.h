#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace vantage {

/// Where an image saw a point: the viewing ray (world frame) and when.
struct RayObservation {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();      ///< camera centre
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit
  double time_s = 0;
  int camera = 0;       ///< which physical camera
  double focal_px = 1;  ///< turns angles into pixels
};

/// x(t) = position + t * velocity: Klose et al. 2011, Eq. 7.
struct LineOfMovement {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< at t = 0
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  bool moves = false;         ///< false: velocity was not supported by the rays and is 0
  double sigma_position = 0;  ///< worst direction, world units, for 1 px of noise
  double sigma_velocity = 0;  ///< worst direction, world units per second; 0 for a static point
  double rms_px = 0;          ///< over the inliers
  std::vector<int> inliers;   ///< indices into the observations, rising
  Eigen::Vector3d at(double time_s) const { return position + time_s * velocity; }
};

/// Least-squares position and velocity from rays at different times: Eq. 8 with the depths a_i eliminated. With the
/// projector P_i = I - q_i q_i^T every ray says P_i (c + t_i v - Phi_i) = 0; the 6x6 normal equations are weighted by
/// (f_i / z_i)^2, so that residuals are pixels, and reweighted (Huber, 1.5 px) three times.
/// Empty when the system is degenerate (condition over 1e8): one static camera, a single moment, …
std::optional<LineOfMovement> solve_moving(std::span<const RayObservation> rays);
/// The same with v = 0. Empty when the rays are (nearly) parallel.
std::optional<LineOfMovement> solve_static(std::span<const RayObservation> rays);

/// Distance in pixels between the observation and the line's reprojection (small angles). Infinite behind the camera.
double reprojection_error_px(const LineOfMovement& line, const RayObservation& ray);

struct LineOfMovementOptions {
  double max_error_px = 1.5;           ///< inlier threshold of RANSAC and of the final check
  double noise_px = 0.5;               ///< expected localisation noise, for the model choice
  double max_sigma_position_px = 2.1;  ///< 0.3 of a 7 px patch, in pixels at the point's depth
  double max_sigma_static_px = 14;     ///< two patches: a still point's depth is refined by its look in all images
  double max_motion_sigma_px = 3.5;    ///< same for sigma_velocity * duration: 0.5 of a patch
  int num_samples = 48;
  int min_observations = 3;
};

/// Robust fit to a match set: RANSAC over minimal subsets (3 rays moving, 2 static), refit on inliers, then the simpler
/// model unless the moving one is well conditioned and better by the Bayesian information criterion.
/// Empty when no model explains min_observations rays of two cameras.
std::optional<LineOfMovement> fit_line_of_movement(std::span<const RayObservation> rays,
                                                   const LineOfMovementOptions& options, std::uint32_t seed);

}  // namespace vantage
