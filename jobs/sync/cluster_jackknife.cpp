#include "jobs/sync/cluster_jackknife.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "schema/base/error.h"

namespace vantage::sync {
namespace {

constexpr double kCellsPerWidth = 12, kCellS = 1;
/// Eigenvalues of a scaled matrix below this are rounding errors.
constexpr double kNoDirection = 1e-9;
/// Of what a cluster knows so much is taken away: where it alone fixes an unknown, the rest would know nothing.
constexpr double kMaxLeftOut = 0.98;

}  // namespace

Cluster cluster_at(const Eigen::Vector2d& px, double time_s, int picture_width_px) {
  check(picture_width_px > 0, "clusters are parts of a picture of known size");
  const double cell_px = picture_width_px / kCellsPerWidth;
  return {std::lround(px.x() / cell_px), std::lround(px.y() / cell_px), std::lround(time_s / kCellS)};
}

void add_part(ClusterParts& parts, const Cluster& cluster, const Eigen::MatrixXd& H, const Eigen::VectorXd& g) {
  const auto [at, is_new] = parts.try_emplace(cluster, NormalPart{H, g});
  if (is_new) return;
  at->second.H += H;
  at->second.g += g;
}

Eigen::MatrixXd jackknife_covariance(const ClusterParts& parts, const Eigen::MatrixXd& H) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(H.rows(), H.cols());
  for (const auto& [cluster, part] : parts) {
    const Eigen::VectorXd moved = pseudo_inverse(H - kMaxLeftOut * part.H) * part.g;
    sum += moved * moved.transpose();
  }
  const auto num = static_cast<double>(parts.size());
  return num > 1 ? Eigen::MatrixXd((num - 1) / num * sum) : sum;
}

double effective_clusters(const ClusterParts& parts, const Eigen::VectorXd& direction) {
  double sum = 0, sum_squares = 0;
  for (const auto& [cluster, part] : parts) {
    const double information = direction.dot(part.H * direction);
    sum += information;
    sum_squares += information * information;
  }
  return sum_squares > 0 ? sum * sum / sum_squares : 0;
}

double student_factor(double degrees_of_freedom) {
  // Within 1 % of the quantiles at 1, 2, 3, ... degrees: 1.84, 1.32, 1.20.
  const double inverse = 1 / std::max(1.0, degrees_of_freedom);
  return 1 + inverse * (0.5 + 0.337 * inverse);
}

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& H) {
  const Eigen::VectorXd scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scale.asDiagonal() * H * scale.asDiagonal());
  const Eigen::VectorXd inverse =
      solver.eigenvalues().unaryExpr([](double x) { return x > kNoDirection ? 1 / x : 0.0; });
  return scale.asDiagonal() * solver.eigenvectors() * inverse.asDiagonal() * solver.eigenvectors().transpose() *
         scale.asDiagonal();
}

}  // namespace vantage::sync
