#include "jobs/sync/fundamental_fit.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

#include "jobs/sync/pair_geometry.h"
#include "jobs/sync/random_draw.h"

namespace vantage::sync {
namespace {

constexpr std::size_t kMinMatches = 12;
constexpr int kReweightings = 6;
/// Draws are scored on so many matches spread over all: enough to tell a good one.
constexpr std::size_t kMaxScored = 200;

using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;

Eigen::Matrix3d with_rank_two(const Eigen::Matrix3d& F) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d s = svd.singularValues();
  s[2] = 0;
  return svd.matrixU() * s.asDiagonal() * svd.matrixV().transpose();
}

/// Squared length of the gradient that turns e = x_b^T F x_a into a distance: Sampson's denominator.
double gradient2(const Eigen::Matrix3d& F, const PointMatch& m) {
  const Eigen::Vector3d Fa = F * m.a.homogeneous(), Fb = F.transpose() * m.b.homogeneous();
  return Fa.head<2>().squaredNorm() + Fb.head<2>().squaredNorm();
}

std::vector<PointMatch> thinned(std::span<const PointMatch> matches, std::size_t max_num) {
  const std::size_t stride = (matches.size() + max_num - 1) / max_num;
  std::vector<PointMatch> out;
  for (std::size_t k = 0; k < matches.size(); k += stride) out.push_back(matches[k]);
  return out;
}

/// Weights that make the algebraic error Sampson's, times Cauchy's.
Eigen::Matrix3d reweighted(std::span<const PointMatch> matches, Eigen::Matrix3d F, double scale_px,
                           const Eigen::Matrix3d& Ta, const Eigen::Matrix3d& Tb) {
  std::vector<double> weights(matches.size());
  for (int round = 0; round < kReweightings; ++round) {
    for (std::size_t k = 0; k < matches.size(); ++k) {
      const double g2 = std::max(gradient2(F, matches[k]), std::numeric_limits<double>::min());
      const double r = sampson_px(F, matches[k].a, matches[k].b) / scale_px;
      weights[k] = 1 / (g2 * (1 + r * r));
    }
    const auto better = eight_point(matches, weights, Ta, Tb);
    if (!better) break;
    F = *better;
  }
  return F;
}

}  // namespace

Eigen::Matrix3d hartley_normalisation(std::span<const Eigen::Vector2d> points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  double spread = 0;
  for (const auto& p : points) spread += (p - mean).norm() / static_cast<double>(points.size());
  const double s = spread > 0 ? std::sqrt(2.0) / spread : 1;
  Eigen::Matrix3d T;
  T << s, 0, -s * mean.x(), 0, s, -s * mean.y(), 0, 0, 1;
  return T;
}

std::optional<Eigen::Matrix3d> eight_point(std::span<const PointMatch> matches, std::span<const double> weights,
                                           const Eigen::Matrix3d& Ta, const Eigen::Matrix3d& Tb) {
  Matrix9 N = Matrix9::Zero();
  int num = 0;
  for (std::size_t k = 0; k < matches.size(); ++k) {
    if (weights[k] <= 0) continue;
    const Eigen::Vector3d a = Ta * matches[k].a.homogeneous(), b = Tb * matches[k].b.homogeneous();
    Vector9 row;
    row << b.x() * a, b.y() * a, b.z() * a;
    N.selfadjointView<Eigen::Lower>().rankUpdate(row, weights[k]);
    ++num;
  }
  if (num < 8) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Matrix9> solver(N);
  const Vector9 f = solver.eigenvectors().col(0);
  Eigen::Matrix3d F;
  F << f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8];
  F = Tb.transpose() * with_rank_two(F) * Ta;
  return F / F.norm();
}

double truncated_cost(std::span<const PointMatch> matches, const Eigen::Matrix3d& F, double max_px) {
  double cost = 0;
  for (const PointMatch& m : matches) {
    const double r = sampson_px(F, m.a, m.b) / max_px;
    cost += std::min(1.0, r * r);
  }
  return cost;
}

std::optional<RobustFundamental> robust_fundamental(std::span<const PointMatch> matches, double max_px, int num_draws,
                                                    std::span<const Eigen::Matrix3d> starts, std::mt19937& random) {
  if (matches.size() < kMinMatches) return std::nullopt;
  std::vector<Eigen::Vector2d> points_a, points_b;
  for (const PointMatch& m : matches) points_a.push_back(m.a), points_b.push_back(m.b);
  const Eigen::Matrix3d Ta = hartley_normalisation(points_a), Tb = hartley_normalisation(points_b);
  std::vector<Eigen::Matrix3d> candidates(starts.begin(), starts.end());
  const std::vector<double> equal(matches.size(), 1);
  if (const auto F = eight_point(matches, equal, Ta, Tb)) candidates.push_back(*F);

  const std::vector<PointMatch> few = thinned(matches, kMaxScored);
  std::optional<RobustFundamental> drawn;
  const std::vector<double> eight_equal(8, 1);
  for (int draw = 0; draw < num_draws; ++draw) {
    const auto eight = draw_from<8>(matches, random);
    const auto F = eight_point(eight, eight_equal, Ta, Tb);
    if (!F) continue;
    const double cost = truncated_cost(few, *F, max_px);
    if (!drawn || cost < drawn->cost) drawn = {*F, cost};
  }
  if (drawn) candidates.push_back(drawn->F);

  std::optional<RobustFundamental> best;
  for (const Eigen::Matrix3d& start : candidates) {
    const Eigen::Matrix3d F = reweighted(matches, start, 0.5 * max_px, Ta, Tb);
    const double cost = truncated_cost(matches, F, max_px);
    if (!best || cost < best->cost) best = {F, cost};
  }
  return best;
}

}  // namespace vantage::sync
