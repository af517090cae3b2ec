#include "jobs/vision/ground_plane.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace vantage {
namespace {

using Eigen::Vector3d;

constexpr int kRounds = 500;
constexpr std::size_t kMinInliers = 50;
constexpr double kMinShare = 0.15;
const double kMaxTilt = std::numbers::pi / 6;

std::vector<Vector3d> lower_half(const std::vector<SparsePoint>& points, const Vector3d& up) {
  std::vector<double> heights;
  for (const SparsePoint& p : points) heights.push_back(up.dot(p.position));
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  std::vector<Vector3d> low;
  for (const SparsePoint& p : points)
    if (up.dot(p.position) <= *middle) low.push_back(p.position);
  return low;
}

std::vector<Vector3d> near_plane(const std::vector<Vector3d>& points, const Vector3d& normal, const Vector3d& on,
                                 double distance) {
  std::vector<Vector3d> near;
  for (const Vector3d& p : points)
    if (std::abs(normal.dot(p - on)) < distance) near.push_back(p);
  return near;
}

/// Plane through inliers: normal of least spread.
GroundPlane fitted_plane(const std::vector<Vector3d>& inliers, const Vector3d& rough_up) {
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : inliers) mean += p / static_cast<double>(inliers.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : inliers) scatter += (p - mean) * (p - mean).transpose();
  Vector3d up = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors().col(0);
  if (up.dot(rough_up) < 0) up = -up;
  return {up, up.dot(mean), inliers.size()};
}

}  // namespace

std::optional<GroundPlane> find_ground_plane(const std::vector<SparsePoint>& points, const Vector3d& rough_up,
                                             double inlier_distance) {
  if (points.size() < kMinInliers) return std::nullopt;
  const std::vector<Vector3d> low = lower_half(points, rough_up);
  std::mt19937 random(1);
  const auto pick = [&] { return low[random() % low.size()]; };
  std::vector<Vector3d> best;
  for (int round = 0; round < kRounds; ++round) {
    const Vector3d a = pick(), b = pick(), c = pick();
    const Vector3d normal = (b - a).cross(c - a).normalized();
    if (!(std::abs(normal.dot(rough_up)) > std::cos(kMaxTilt))) continue;
    std::vector<Vector3d> inliers = near_plane(low, normal, a, inlier_distance);
    if (inliers.size() > best.size()) best = std::move(inliers);
  }
  if (best.size() < kMinInliers || static_cast<double>(best.size()) < kMinShare * static_cast<double>(points.size()))
    return std::nullopt;
  return fitted_plane(best, rough_up);
}

}  // namespace vantage
