#include "jobs/sync/clock_information.h"

#include <ceres/crs_matrix.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "jobs/sync/cluster_jackknife.h"

namespace vantage::sync {
namespace {

/// Of the information, so much must be more than noise would feign.
constexpr double kMinInformation = 0.3;

/// Rows of residual blocks in the order of evaluation.
struct Linearised {
  Eigen::MatrixXd J;
  Eigen::VectorXd r;
};

Linearised linearise(ceres::Problem& problem, JointState& state, const JointData& data,
                     std::vector<ceres::ResidualBlockId> blocks) {
  ceres::Problem::EvaluateOptions options;
  options.apply_loss_function = false;
  options.residual_blocks = std::move(blocks);
  options.parameter_blocks = {state.U.coeffs().data(), state.V.coeffs().data()};
  if (!data.options.lens_a || !data.options.lens_b) options.parameter_blocks.push_back(&state.s);
  options.parameter_blocks.push_back(state.clock);
  std::vector<double> residuals;
  ceres::CRSMatrix crs;
  problem.Evaluate(options, nullptr, &residuals, nullptr, &crs);
  Linearised out{Eigen::MatrixXd::Zero(crs.num_rows, crs.num_cols),
                 Eigen::Map<Eigen::VectorXd>(residuals.data(), std::ssize(residuals))};
  for (int row = 0; row < crs.num_rows; ++row)
    for (int k = crs.rows[static_cast<std::size_t>(row)]; k < crs.rows[static_cast<std::size_t>(row) + 1]; ++k)
      out.J(row, crs.cols[static_cast<std::size_t>(k)]) = crs.values[static_cast<std::size_t>(k)];
  return out;
}

Cluster cluster_of(const PathRun& run, const JointOptions& options) {
  const std::size_t middle = run.a.size() / 2;
  return cluster_at(run.a[middle], run.times_a_s[middle], options.width_a_px);
}

struct RunTerm {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  double chi2 = 0, num = 0, weight = 0;
};

std::vector<RunTerm> run_terms(const Linearised& linear, const std::vector<PathRun>& runs) {
  std::vector<RunTerm> terms;
  Eigen::Index first = 0;
  for (const PathRun& run : runs) {
    const Eigen::Index n = std::ssize(run.a);
    const auto J = linear.J.middleRows(first, n);
    const auto r = linear.r.segment(first, n);
    const double mean_chi2 = r.squaredNorm();
    const double weight = 1 / (1 + mean_chi2 / (kRunLossScale * kRunLossScale));
    const double factor = weight * static_cast<double>(n);
    terms.push_back({factor * J.transpose() * J, factor * J.transpose() * r, factor * mean_chi2,
                     weight * static_cast<double>(n), weight});
    first += n;
  }
  return terms;
}

/// Length of the gradient of Sampson's distance by b's point, in which a's has its share: 0 to 1.
double slope_by_b(const Eigen::Matrix3d& F, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector3d Fa = F * a.homogeneous(), Fb = F.transpose() * b.homogeneous();
  return Fa.head<2>().norm() / std::hypot(Fa.head<2>().norm(), Fb.head<2>().norm());
}

/// What noise in b's velocities alone adds to the clock's information, in the units of JointState::clock.
Eigen::Matrix2d feigned_information(const JointState& state, const JointData& data, const std::vector<RunTerm>& terms) {
  const Eigen::Matrix3d F = state.fundamental();
  Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < data.runs.size(); ++i) {
    const PathRun& run = data.runs[i];
    const TimedTrack& b = data.pairs[run.pair].b;
    for (std::size_t k = 0; k < run.a.size(); ++k) {
      const double time_b_s = state.time_b_s(run.times_a_s[k]);
      const double std_per_px = b.velocity_at(time_b_s).std_per_px;
      const Eigen::Vector2d by_clock(-1 / state.rate(), -1e-3 * (time_b_s - state.pivot_b_s) / state.rate());
      const double slope = slope_by_b(F, run.a[k], *b.at(time_b_s)) * std_per_px;
      H += terms[i].weight * slope * slope * by_clock * by_clock.transpose();
    }
  }
  return H;
}

}  // namespace

std::optional<ClockInformation> clock_information(JointState state, const JointData& data) {
  std::vector<ceres::ResidualBlockId> run_blocks, still_blocks;
  const auto problem = make_problem(state, data, run_blocks, still_blocks);
  const std::vector<RunTerm> terms = run_terms(linearise(*problem, state, data, run_blocks), data.runs);
  const Eigen::Index size = terms.front().H.rows(), clocks = data.options.estimate_rate ? 2 : 1, rest = size - clocks;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size, size);
  double chi2 = 0, num = 0;
  for (const RunTerm& term : terms) {
    H += term.H;
    chi2 += term.chi2;
    num += term.num;
  }
  if (!still_blocks.empty()) {
    Linearised linear = linearise(*problem, state, data, still_blocks);
    for (Eigen::Index k = 0; k < linear.r.size(); ++k)
      linear.J.row(k) /= std::sqrt(1 + linear.r[k] * linear.r[k] / (kRunLossScale * kRunLossScale));
    H += linear.J.transpose() * linear.J;
  }
  // How the geometry follows the clock; what the clock does then is all it is known by.
  const Eigen::MatrixXd follow = pseudo_inverse(H.topLeftCorner(rest, rest)) * H.topRightCorner(rest, clocks);
  Eigen::MatrixXd along(size, clocks);
  along << -follow, Eigen::MatrixXd::Identity(clocks, clocks);
  const Eigen::MatrixXd S = along.transpose() * H * along;
  const Eigen::MatrixXd real = S - feigned_information(state, data, terms).topLeftCorner(clocks, clocks);
  if (!(real(0, 0) > kMinInformation * S(0, 0)) || !(real.determinant() > 0)) return std::nullopt;

  ClusterParts parts;
  ClockInformation out;
  double sum = 0, sum2 = 0;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const RunTerm& term = terms[i];
    add_part(parts, cluster_of(data.runs[i], data.options), term.H, term.g);
    const double information = along.col(0).dot(term.H * along.col(0));
    sum += information;
    sum2 += information * information;
    out.num_believed_runs += term.weight > 0.5 ? 1 : 0;
  }
  out.effective_runs = sum2 > 0 ? sum * sum / sum2 : 0;
  const Eigen::MatrixXd inverse = real.inverse(), dilution = inverse * S;
  const Eigen::MatrixXd fisher = inverse * S * inverse * std::max(1.0, chi2 / std::max(num, 1.0));
  const Eigen::MatrixXd jackknife =
      dilution * jackknife_covariance(parts, H).bottomRightCorner(clocks, clocks) * dilution.transpose();
  const double factor = student_factor(effective_clusters(parts, along.col(0)) - static_cast<double>(clocks));
  const Eigen::MatrixXd covariance = factor * factor * (jackknife(0, 0) > fisher(0, 0) ? jackknife : fisher);
  Eigen::MatrixXd units = Eigen::MatrixXd::Identity(clocks, clocks);
  if (clocks == 2) units(1, 1) = 1e-3;
  out.covariance.topLeftCorner(clocks, clocks) = units * covariance * units;
  return out;
}

}  // namespace vantage::sync
