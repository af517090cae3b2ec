#include "jobs/align/joint_information.h"

#include <ceres/cost_function.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <map>

namespace vantage::align {
namespace {

using Columns = std::unordered_map<const double*, Eigen::Index>;

/// Keeps points that their cameras do not hold from being divided by nothing.
constexpr double kRidge = 1e-9;

Columns columns_of(const ceres::Problem& problem, const JointState& state, Eigen::Index& size) {
  Columns columns;
  size = 0;
  const auto add = [&](const double* block) {
    if (!problem.HasParameterBlock(block) || problem.IsParameterBlockConstant(const_cast<double*>(block))) return;
    columns[block] = size;
    size += problem.ParameterBlockTangentSize(block);
  };
  for (const auto& camera : state.cameras) add(camera.clock.data()), add(camera.pose.data()), add(&camera.focal);
  return columns;
}

/// A group of residuals, linear: by the cameras' unknowns, and by their own.
struct Linear {
  Eigen::MatrixXd by_cameras, by_own;
  Eigen::VectorXd residual;
};

Linear linearise(const ceres::Problem& problem, const std::vector<ceres::ResidualBlockId>& ids, const Columns& cameras,
                 Eigen::Index num_camera) {
  Columns own;
  Eigen::Index num_own = 0, num_rows = 0;
  std::vector<double*> blocks;
  for (const auto id : ids) {
    num_rows += problem.GetCostFunctionForResidualBlock(id)->num_residuals();
    problem.GetParameterBlocksForResidualBlock(id, &blocks);
    for (double* block : blocks)
      if (!cameras.contains(block) && !problem.IsParameterBlockConstant(block) && own.emplace(block, num_own).second)
        num_own += problem.ParameterBlockTangentSize(block);
  }
  Linear out{Eigen::MatrixXd::Zero(num_rows, num_camera), Eigen::MatrixXd::Zero(num_rows, num_own),
             Eigen::VectorXd::Zero(num_rows)};
  Eigen::Index row = 0;
  for (const auto id : ids) {
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    problem.GetParameterBlocksForResidualBlock(id, &blocks);
    const Eigen::Index rows = problem.GetCostFunctionForResidualBlock(id)->num_residuals();
    std::vector<RowMajor> J(blocks.size());
    std::vector<double*> J_data(blocks.size(), nullptr);
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      if (problem.IsParameterBlockConstant(blocks[b])) continue;
      J[b].resize(rows, problem.ParameterBlockTangentSize(blocks[b]));
      J_data[b] = J[b].data();
    }
    problem.EvaluateResidualBlockAssumingParametersUnchanged(id, true, nullptr, out.residual.data() + row,
                                                             J_data.data());
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      if (!J_data[b]) continue;
      const auto camera = cameras.find(blocks[b]);
      if (camera != cameras.end())
        out.by_cameras.block(row, camera->second, rows, J[b].cols()) = J[b];
      else
        out.by_own.block(row, own.at(blocks[b]), rows, J[b].cols()) = J[b];
    }
    row += rows;
  }
  return out;
}

/// What a group says of the cameras.
struct Reduced {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

/// How the derivatives by a group's own unknowns change with the clocks, whose steps turn them.
Eigen::MatrixXd own_by_clock(const ceres::Problem& problem, const std::vector<ceres::ResidualBlockId>& ids,
                             const Columns& columns, Eigen::Index num_camera, JointState& state) {
  constexpr double kStepS = 1e-4;
  const auto shifted = [&](double step_s) {
    for (auto& camera : state.cameras) camera.clock[0] += step_s;
    Eigen::MatrixXd by_own = linearise(problem, ids, columns, num_camera).by_own;
    for (auto& camera : state.cameras) camera.clock[0] -= step_s;
    return by_own;
  };
  return (shifted(kStepS) - shifted(-kStepS)) / (2 * kStepS);
}

/// What of a group's information on the clocks is not motion but noise: a path that follows noise moves where the point
/// does not. With own unknowns' covariance C and turning derivatives D: the expectation of (D δ)ᵀ P (D δ), P being what
/// is left when the own unknowns are eliminated.
Eigen::MatrixXd noise_in_clocks(const Linear& group, const Eigen::MatrixXd& D, const Columns& columns,
                                const JointState& state) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(group.by_cameras.cols(), group.by_cameras.cols());
  Eigen::MatrixXd N = group.by_own.transpose() * group.by_own;
  N.diagonal() *= 1 + kRidge;
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(N);
  std::vector<std::pair<Eigen::Index, Eigen::MatrixXd>> parts;  // of D: the rows of each clock
  for (const auto& camera : state.cameras) {
    const auto column = columns.find(camera.clock.data());
    if (column == columns.end() || group.by_cameras.col(column->second).isZero()) continue;
    const Eigen::VectorXd own_rows = (group.by_cameras.col(column->second).array() != 0).cast<double>().matrix();
    parts.emplace_back(column->second, own_rows.asDiagonal() * D);
  }
  for (const auto& [i, D_i] : parts)
    for (const auto& [j, D_j] : parts) {
      const Eigen::MatrixXd DC = ldlt.solve(D_i.transpose()).transpose();
      const Eigen::MatrixXd left = D_j - group.by_own * ldlt.solve(group.by_own.transpose() * D_j);
      out(i, j) = DC.cwiseProduct(left).sum();
    }
  return out;
}

Reduced eliminate_own(const Linear& group) {
  Reduced out{group.by_cameras.transpose() * group.by_cameras, group.by_cameras.transpose() * group.residual};
  if (group.by_own.cols() == 0) return out;
  Eigen::MatrixXd N = group.by_own.transpose() * group.by_own;
  N.diagonal() *= 1 + kRidge;
  const Eigen::MatrixXd cross = group.by_own.transpose() * group.by_cameras;
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(N);
  out.H -= cross.transpose() * ldlt.solve(cross);
  out.g -= cross.transpose() * ldlt.solve(group.by_own.transpose() * group.residual);
  return out;
}

/// The sum over groups, and what its parts scatter by.
class Sum {
 public:
  explicit Sum(Eigen::Index size) : H_(Eigen::MatrixXd::Zero(size, size)), prior_(H_), noise_(H_) {}

  void add(const Linear& group, long cluster) {
    const Reduced reduced = eliminate_own(group);
    H_ += reduced.H;
    scores_.try_emplace(cluster, Eigen::VectorXd::Zero(H_.rows())).first->second += reduced.g;
    chi2_ += group.residual.squaredNorm();
    freedom_ += static_cast<double>(group.by_own.rows() - group.by_own.cols());
  }
  void add_prior(const Linear& prior) { prior_ += prior.by_cameras.transpose() * prior.by_cameras; }
  void add_noise(const Eigen::MatrixXd& noise) { noise_ += noise; }

  double reduced_chi2() const {
    return std::max(1.0, chi2_ / std::max(1.0, freedom_ - static_cast<double>(H_.rows())));
  }
  Eigen::MatrixXd covariance() const {
    const Eigen::MatrixXd inverse = inverse_of(without_noise() + prior_);
    const Eigen::MatrixXd fisher = reduced_chi2() * inverse;
    const auto num = static_cast<double>(scores_.size());
    if (num < 2) return fisher;
    Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(H_.rows(), H_.cols());
    for (const auto& [cluster, score] : scores_) meat += num / (num - 1) * score * score.transpose();
    const Eigen::MatrixXd sandwich = inverse * meat * inverse;
    // The larger variance of each unknown, correlations as the information has them.
    const Eigen::VectorXd scale = (sandwich.diagonal().array() / fisher.diagonal().array()).max(1.0).sqrt().matrix();
    return scale.asDiagonal() * fisher * scale.asDiagonal();
  }

 private:
  static Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& H) {
    return H.ldlt().solve(Eigen::MatrixXd::Identity(H.rows(), H.cols()));
  }
  /// H less what noise put there, as far as it is more than nothing in any direction.
  Eigen::MatrixXd without_noise() const {
    const Eigen::VectorXd unit = H_.diagonal().cwiseMax(1e-12).cwiseSqrt();
    const Eigen::MatrixXd scaled = unit.cwiseInverse().asDiagonal() * (H_ - noise_) * unit.cwiseInverse().asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
    const Eigen::MatrixXd V = unit.asDiagonal() * eigen.eigenvectors();
    return V * eigen.eigenvalues().cwiseMax(1e-9).asDiagonal() * V.transpose();
  }

  Eigen::MatrixXd H_, prior_, noise_;
  std::map<long, Eigen::VectorXd> scores_;
  double chi2_ = 0, freedom_ = 0;
};

}  // namespace

CameraCovariance covariance_of_cameras(const JointProblem& problem, JointState& state,
                                       const std::vector<long>& clusters) {
  CameraCovariance out;
  Eigen::Index size = 0;
  out.column = columns_of(*problem.problem, state, size);
  Sum sum(size);
  long next_cluster = clusters.empty() ? 0 : *std::max_element(clusters.begin(), clusters.end()) + 1;
  for (std::size_t i = 0; i < problem.moving.size(); ++i) {
    const Linear group = linearise(*problem.problem, problem.moving[i], out.column, size);
    const Eigen::MatrixXd D = own_by_clock(*problem.problem, problem.moving[i], out.column, size, state);
    sum.add(group, clusters[i]);
    sum.add_noise(noise_in_clocks(group, D, out.column, state));
  }
  for (const auto& ids : problem.still) sum.add(linearise(*problem.problem, ids, out.column, size), next_cluster++);
  for (const auto id : problem.priors) sum.add_prior(linearise(*problem.problem, {id}, out.column, size));
  out.covariance = sum.covariance();
  out.reduced_chi2 = sum.reduced_chi2();
  return out;
}

}  // namespace vantage::align
