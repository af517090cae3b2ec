#include "jobs/sync/joint_problem.h"

#include <ceres/ceres.h>

#include <Eigen/SVD>
#include <cmath>

namespace vantage::sync {
namespace {

template <typename T>
using Matrix3 = Eigen::Matrix<T, 3, 3>;
template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

/// F in pixels from the parameter blocks.
template <typename T>
Matrix3<T> fundamental_of(const T* U, const T* V, const T* s, const Eigen::Matrix3d& Ta, const Eigen::Matrix3d& Tb) {
  const Eigen::Map<const Eigen::Quaternion<T>> qU(U), qV(V);
  const Matrix3<T> RU = qU.toRotationMatrix(), RV = qV.toRotationMatrix();
  const Matrix3<T> E = RU.col(0) * RV.col(0).transpose() + s[0] * RU.col(1) * RV.col(1).transpose();
  return Tb.transpose().cast<T>() * E * Ta.cast<T>();
}

template <typename T>
T sampson(const Matrix3<T>& F, const Eigen::Vector2d& a_px, const Eigen::Matrix<T, 2, 1>& b_px) {
  const Vector3<T> b(b_px.x(), b_px.y(), T(1));
  const Vector3<T> Fa = F * a_px.homogeneous().cast<T>(), Fb = F.transpose() * b;
  const T g2 = Fa[0] * Fa[0] + Fa[1] * Fa[1] + Fb[0] * Fb[0] + Fb[1] * Fb[1];
  return b.dot(Fa) / sqrt(g2 + 1e-300);
}

double value_of(double x) { return x; }
template <typename T, int N>
double value_of(const ceres::Jet<T, N>& x) {
  return x.a;
}

/// b's path at a time that may carry derivatives; straight on beyond its ends, so that a step may leave them.
template <typename T>
Eigen::Matrix<T, 2, 1> place_at(const TimedTrack& b, const T& time_s) {
  const double inside_s = std::clamp(value_of(time_s), b.begin_s(), b.end_s());
  const Eigen::Vector2d px = *b.at(inside_s), velocity = b.velocity_at(inside_s).px_per_s;
  const T ahead_s = time_s - T(inside_s);
  return {px.x() + velocity.x() * ahead_s, px.y() + velocity.y() * ahead_s};
}

struct RunResiduals {
  const PathRun& run;
  const TimedTrack& b;
  Eigen::Matrix3d Ta, Tb;
  double pivot_a_s, pivot_b_s;
  RunNoise noise;

  template <typename T>
  bool operator()(T const* const* p, T* r) const {
    const Matrix3<T> F = fundamental_of(p[0], p[1], p[2], Ta, Tb);
    const T shift_s = p[3][0], rate = 1.0 + 1e-3 * p[3][1];
    const std::size_t n = run.a.size();
    T mean(0);
    for (std::size_t k = 0; k < n; ++k) {
      const T time_b_s = pivot_b_s + (run.times_a_s[k] - pivot_a_s - shift_s) / rate;
      r[k] = sampson<T>(F, run.a[k], place_at(b, time_b_s));
      mean += r[k] / static_cast<double>(n);
    }
    // (σ² I + σ_b² 1 1ᵀ)^(-1/2): the mean has another standard deviation than what is left.
    const auto num = static_cast<double>(n);
    const double of_mean = noise.sample_px / std::hypot(noise.sample_px, std::sqrt(num) * noise.bias_px);
    for (std::size_t k = 0; k < n; ++k) r[k] = (r[k] - (1 - of_mean) * mean) / (noise.sample_px * std::sqrt(num));
    return true;
  }
};

struct StillResidual {
  PointMatch match;
  Eigen::Matrix3d Ta, Tb;
  double std_px;

  template <typename T>
  bool operator()(const T* U, const T* V, const T* s, T* r) const {
    const Eigen::Matrix<T, 2, 1> b = match.b.cast<T>();
    r[0] = sampson<T>(fundamental_of(U, V, s, Ta, Tb), match.a, b) / std_px;
    return true;
  }
};

Eigen::Quaterniond rotation_of(Eigen::Matrix3d M) {
  if (M.determinant() < 0) M.col(2) = -M.col(2);  // the null vector's sign does not matter
  return Eigen::Quaterniond(M);
}

void add_run(ceres::Problem& problem, JointState& state, const JointData& data, const PathRun& run,
             std::vector<ceres::ResidualBlockId>& blocks) {
  auto* cost = new ceres::DynamicAutoDiffCostFunction<RunResiduals, 12>(
      new RunResiduals{run, data.pairs[run.pair].b, state.Ta, state.Tb, state.pivot_a_s, state.pivot_b_s, data.noise});
  for (const int size : {4, 4, 1, 2}) cost->AddParameterBlock(size);
  const auto n = static_cast<double>(run.a.size());
  cost->SetNumResiduals(static_cast<int>(run.a.size()));
  auto* loss = new ceres::ScaledLoss(new ceres::CauchyLoss(kRunLossScale), n, ceres::TAKE_OWNERSHIP);
  blocks.push_back(problem.AddResidualBlock(
      cost, loss, std::vector<double*>{state.U.coeffs().data(), state.V.coeffs().data(), &state.s, state.clock}));
}

}  // namespace

Eigen::Matrix3d JointState::fundamental() const {
  const Eigen::Matrix3d F = fundamental_of(U.coeffs().data(), V.coeffs().data(), &s, Ta, Tb);
  return F / F.norm();
}

std::optional<JointState> start_state(const std::vector<PathRun>& runs, const std::vector<PathPair>& pairs,
                                      const Eigen::Matrix3d& F, double offset_s, double rate,
                                      const JointOptions& options) {
  JointState state;
  std::vector<Eigen::Vector2d> points_a, points_b;
  double sum_a = 0, sum_b = 0;
  for (const PathRun& run : runs)
    for (std::size_t k = 0; k < run.a.size(); ++k) {
      const double time_b_s = (run.times_a_s[k] - offset_s) / rate;
      const auto b = pairs[run.pair].b.at(time_b_s);
      if (!b) continue;
      points_a.push_back(run.a[k]);
      points_b.push_back(*b);
      sum_a += run.times_a_s[k];
      sum_b += time_b_s;
    }
  if (points_a.empty()) return std::nullopt;
  state.pivot_a_s = sum_a / static_cast<double>(points_a.size());
  state.pivot_b_s = sum_b / static_cast<double>(points_b.size());
  state.clock[0] = offset_s + rate * state.pivot_b_s - state.pivot_a_s;
  state.clock[1] = 1e3 * (rate - 1);
  const bool rays = options.lens_a && options.lens_b;
  state.Ta = rays ? Eigen::Matrix3d(options.lens_a->K().inverse()) : hartley_normalisation(points_a);
  state.Tb = rays ? Eigen::Matrix3d(options.lens_b->K().inverse()) : hartley_normalisation(points_b);
  const Eigen::Matrix3d E = state.Tb.transpose().inverse() * F * state.Ta.inverse();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(E, Eigen::ComputeFullU | Eigen::ComputeFullV);
  state.U = rotation_of(svd.matrixU());
  state.V = rotation_of(svd.matrixV());
  state.s = rays ? 1 : svd.singularValues()[1] / svd.singularValues()[0];
  return state;
}

std::unique_ptr<ceres::Problem> make_problem(JointState& state, const JointData& data,
                                             std::vector<ceres::ResidualBlockId>& run_blocks,
                                             std::vector<ceres::ResidualBlockId>& still_blocks) {
  auto problem = std::make_unique<ceres::Problem>();
  double *U = state.U.coeffs().data(), *V = state.V.coeffs().data();
  problem->AddParameterBlock(U, 4, new ceres::EigenQuaternionManifold);
  problem->AddParameterBlock(V, 4, new ceres::EigenQuaternionManifold);
  problem->AddParameterBlock(&state.s, 1);
  if (data.options.estimate_rate)
    problem->AddParameterBlock(state.clock, 2);
  else
    problem->AddParameterBlock(state.clock, 2, new ceres::SubsetManifold(2, {1}));
  if (data.options.lens_a && data.options.lens_b) problem->SetParameterBlockConstant(&state.s);
  for (const PathRun& run : data.runs) add_run(*problem, state, data, run, run_blocks);
  for (const PointMatch& match : data.still) {
    auto* cost = new ceres::AutoDiffCostFunction<StillResidual, 1, 4, 4, 1>(
        new StillResidual{match, state.Ta, state.Tb, data.noise.sample_px});
    still_blocks.push_back(problem->AddResidualBlock(cost, new ceres::CauchyLoss(kRunLossScale), U, V, &state.s));
  }
  return problem;
}

void improve(JointState& state, const JointData& data) {
  std::vector<ceres::ResidualBlockId> run_blocks, still_blocks;
  const auto problem = make_problem(state, data, run_blocks, still_blocks);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 50;
  options.function_tolerance = 1e-8;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  ceres::Solver::Summary summary;
  ceres::Solve(options, problem.get(), &summary);
}

}  // namespace vantage::sync
