#pragma once
#include <Eigen/Core>
#include <optional>
#include <random>
#include <span>
#include <vector>

namespace vantage::sync {

/// A point seen by both cameras at one moment. Pixels.
struct PointMatch {
  Eigen::Vector2d a, b;
};

/// Hartley & Zisserman 2003, §4.4.4: the map that brings the points' centroid to the origin and their mean distance
/// from it to √2.
Eigen::Matrix3d hartley_normalisation(std::span<const Eigen::Vector2d> points_px);

/// Rank-2 fundamental matrix (x_b^T F x_a = 0, unit norm) by the weighted eight-point algorithm; weights as many as
/// matches. Ta, Tb: the cameras' normalisations. Empty when fewer than eight weights are above zero.
std::optional<Eigen::Matrix3d> eight_point(std::span<const PointMatch> matches, std::span<const double> weights,
                                           const Eigen::Matrix3d& Ta, const Eigen::Matrix3d& Tb);

/// Σ min(1, (r / max_px)²) over the matches, r the Sampson distance: Torr & Zisserman's MSAC.
double truncated_cost(std::span<const PointMatch> matches, const Eigen::Matrix3d& F, double max_px);

struct RobustFundamental {
  Eigen::Matrix3d F;
  double cost = 0;  ///< truncated_cost
};

/// Fundamental matrix of least truncated cost among those found from all matches, from `starts` and from num_draws
/// random eights, each improved by iteratively reweighted least squares (Cauchy). Empty with fewer than twelve matches:
/// eight fit any matrix, fewer than half as many again do not test it.
std::optional<RobustFundamental> robust_fundamental(std::span<const PointMatch> matches, double max_px, int num_draws,
                                                    std::span<const Eigen::Matrix3d> starts, std::mt19937& random);

}  // namespace vantage::sync
