#include "jobs/reconstruct/line_of_movement.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

namespace vantage {
namespace {

constexpr double kMaxCondition = 1e8;
constexpr double kHuberPx = 1.5;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Times shifted and scaled to unit size, so that position and velocity are alike in the normal equations.
struct TimeScale {
  double mean = 0, size = 1;
  explicit TimeScale(std::span<const RayObservation> rays) {
    for (const auto& r : rays) mean += r.time_s / static_cast<double>(rays.size());
    double square = 0;
    for (const auto& r : rays) square += (r.time_s - mean) * (r.time_s - mean) / static_cast<double>(rays.size());
    if (square > 0) size = std::sqrt(square);
  }
  double operator()(double time_s) const { return (time_s - mean) / size; }
};

double pixels_per_unit(const LineOfMovement& line, const RayObservation& ray) {
  const double depth = ray.direction.dot(line.at(ray.time_s) - ray.origin);
  return ray.focal_px / std::max(depth, 1e-9);
}

double huber_weight(double error_px) { return error_px <= kHuberPx ? 1.0 : kHuberPx / error_px; }

/// Weights (f/z)^2 and Huber's from the last estimate; without one all rays count the same.
std::vector<double> weights(std::span<const RayObservation> rays, const std::optional<LineOfMovement>& last) {
  std::vector<double> w(rays.size(), 1.0);
  if (!last) return w;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double error = reprojection_error_px(*last, rays[i]);
    if (!std::isfinite(error)) continue;  // behind a camera in a first guess: the plain weight leaves it a say
    const double scale = pixels_per_unit(*last, rays[i]);
    w[i] = scale * scale * huber_weight(error);
  }
  return w;
}

/// Inverse of a normal matrix, or nothing when its condition is too bad to mean anything.
template <int N>
std::optional<Eigen::Matrix<double, N, N>> checked_inverse(const Eigen::Matrix<double, N, N>& normal) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> eigen(normal);
  const double low = eigen.eigenvalues()(0), high = eigen.eigenvalues()(N - 1);
  if (!(low > 0) || high > kMaxCondition * low) return std::nullopt;
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
}

double largest_sigma(const Eigen::Matrix3d& covariance) {
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues()(2));
}

std::optional<LineOfMovement> moving_step(std::span<const RayObservation> rays, const std::vector<double>& w) {
  const TimeScale scaled(rays);
  Matrix6d normal = Matrix6d::Zero();
  Vector6d right = Vector6d::Zero();
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double t = scaled(rays[i].time_s);
    const Eigen::Matrix3d P = w[i] * (Eigen::Matrix3d::Identity() - rays[i].direction * rays[i].direction.transpose());
    const Eigen::Vector3d b = P * rays[i].origin;
    normal.topLeftCorner<3, 3>() += P;
    normal.topRightCorner<3, 3>() += t * P;
    normal.bottomLeftCorner<3, 3>() += t * P;
    normal.bottomRightCorner<3, 3>() += t * t * P;
    right.head<3>() += b;
    right.tail<3>() += t * b;
  }
  const auto inverse = checked_inverse<6>(normal);
  if (!inverse) return std::nullopt;
  const Vector6d x = *inverse * right;
  LineOfMovement line;
  line.moves = true;
  line.velocity = x.tail<3>() / scaled.size;
  line.position = x.head<3>() - scaled.mean * line.velocity;
  line.sigma_position = largest_sigma(inverse->topLeftCorner<3, 3>());
  line.sigma_velocity = largest_sigma(inverse->bottomRightCorner<3, 3>()) / scaled.size;
  return line;
}

std::optional<LineOfMovement> static_step(std::span<const RayObservation> rays, const std::vector<double>& w) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Eigen::Matrix3d P = w[i] * (Eigen::Matrix3d::Identity() - rays[i].direction * rays[i].direction.transpose());
    normal += P;
    right += P * rays[i].origin;
  }
  const auto inverse = checked_inverse<3>(normal);
  if (!inverse) return std::nullopt;
  LineOfMovement line;
  line.position = *inverse * right;
  line.sigma_position = largest_sigma(*inverse);
  return line;
}

template <class Step>
std::optional<LineOfMovement> reweighted(std::span<const RayObservation> rays, const Step& step) {
  std::optional<LineOfMovement> line = step(rays, weights(rays, std::nullopt));
  for (int round = 0; round < 3 && line; ++round) line = step(rays, weights(rays, line));
  if (!line) return line;
  double square = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    line->inliers.push_back(static_cast<int>(i));
    square += std::pow(reprojection_error_px(*line, rays[i]), 2);
  }
  line->rms_px = std::sqrt(square / static_cast<double>(rays.size()));
  return line;
}

std::vector<RayObservation> pick(std::span<const RayObservation> rays, const std::vector<int>& indices) {
  std::vector<RayObservation> out;
  for (const int i : indices) out.push_back(rays[static_cast<std::size_t>(i)]);
  return out;
}

std::size_t num_cameras(std::span<const RayObservation> rays) {
  std::set<int> cameras;
  for (const auto& r : rays) cameras.insert(r.camera);
  return cameras.size();
}

std::vector<int> inliers_of(const LineOfMovement& line, std::span<const RayObservation> rays, double max_error_px) {
  std::vector<int> out;
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (reprojection_error_px(line, rays[i]) <= max_error_px) out.push_back(static_cast<int>(i));
  return out;
}

using Solver = std::optional<LineOfMovement> (*)(std::span<const RayObservation>);

/// The largest set of rays that one minimal sample explains. The first sample is all rays: most sets have no outlier.
std::vector<int> consensus(std::span<const RayObservation> rays, Solver solve, std::size_t sample_size,
                           const LineOfMovementOptions& options, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<int> order(rays.size()), best;
  for (std::size_t i = 0; i < rays.size(); ++i) order[i] = static_cast<int>(i);
  std::vector<int> sample = order;
  for (int k = 0; k <= options.num_samples && best.size() < rays.size(); ++k) {
    if (const auto line = solve(pick(rays, sample))) {
      std::vector<int> found = inliers_of(*line, rays, options.max_error_px);
      if (found.size() > best.size()) best = std::move(found);
    }
    for (std::size_t i = 0; i < sample_size; ++i) std::swap(order[i], order[i + random() % (order.size() - i)]);
    sample.assign(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(sample_size));
  }
  return best;
}

/// Best model of one kind on its consensus set, or nothing when that is too small or from one camera only.
std::optional<LineOfMovement> robust(std::span<const RayObservation> rays, Solver solve, std::size_t sample_size,
                                     const LineOfMovementOptions& options, std::uint32_t seed) {
  if (rays.size() < sample_size) return std::nullopt;
  std::vector<int> inliers = consensus(rays, solve, sample_size, options, seed);
  std::optional<LineOfMovement> line;
  for (int round = 0; round < 2; ++round) {
    const std::vector<RayObservation> used = pick(rays, inliers);
    if (static_cast<int>(used.size()) < options.min_observations || num_cameras(used) < 2) return std::nullopt;
    line = solve(used);
    if (!line) return std::nullopt;
    line->inliers = inliers;
    inliers = inliers_of(*line, rays, options.max_error_px);
  }
  return line;
}

double duration(std::span<const RayObservation> rays) {
  const auto [a, b] =
      std::minmax_element(rays.begin(), rays.end(), [](auto& l, auto& r) { return l.time_s < r.time_s; });
  return b->time_s - a->time_s;
}

bool well_conditioned(const LineOfMovement& line, std::span<const RayObservation> rays,
                      const LineOfMovementOptions& o) {
  const double unit = pixels_per_unit(line, rays[static_cast<std::size_t>(line.inliers.front())]);
  const double noise = o.noise_px * unit;
  return noise * line.sigma_position <= (line.moves ? o.max_sigma_position_px : o.max_sigma_static_px) &&
         noise * line.sigma_velocity * duration(rays) <= o.max_motion_sigma_px;
}

/// Bayesian information criterion with outliers paying the threshold.
double bic(const LineOfMovement& line, std::span<const RayObservation> rays, const LineOfMovementOptions& o) {
  double cost = 0;
  for (const auto& r : rays) cost += std::pow(std::min(reprojection_error_px(line, r), o.max_error_px) / o.noise_px, 2);
  return cost + (line.moves ? 6 : 3) * std::log(2.0 * static_cast<double>(rays.size()));
}

}  // namespace

double reprojection_error_px(const LineOfMovement& line, const RayObservation& ray) {
  const Eigen::Vector3d to_point = line.at(ray.time_s) - ray.origin;
  const double depth = ray.direction.dot(to_point);
  if (depth <= 0) return std::numeric_limits<double>::infinity();
  return ray.focal_px * (to_point - depth * ray.direction).norm() / depth;
}

std::optional<LineOfMovement> solve_moving(std::span<const RayObservation> rays) {
  if (rays.size() < 3) return std::nullopt;
  return reweighted(rays, moving_step);
}

std::optional<LineOfMovement> solve_static(std::span<const RayObservation> rays) {
  if (rays.size() < 2) return std::nullopt;
  return reweighted(rays, static_step);
}

std::optional<LineOfMovement> fit_line_of_movement(std::span<const RayObservation> rays,
                                                   const LineOfMovementOptions& options, std::uint32_t seed) {
  auto still = robust(rays, solve_static, 2, options, seed);
  if (still && !well_conditioned(*still, rays, options)) still.reset();
  auto moving = robust(rays, solve_moving, 3, options, seed);
  if (moving && !well_conditioned(*moving, rays, options)) moving.reset();
  if (still && moving) return bic(*still, rays, options) <= bic(*moving, rays, options) ? still : moving;
  return still ? still : moving;
}

}  // namespace vantage
