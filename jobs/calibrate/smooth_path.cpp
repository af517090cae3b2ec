#include "jobs/calibrate/smooth_path.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "schema/base/error.h"
#include "schema/base/median.h"

namespace vantage {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr int kRounds = 3;  // the system is linear but for how turns add up
/// The prior is never taken to be surer than this part of the measurements: a hand is never quite still.
constexpr double kLeastShare = 1e-3;

Eigen::Vector3d turn_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
  const Eigen::AngleAxisd turn(to * from.transpose());
  return turn.angle() * turn.axis();
}

/// Weights of three samples in a second difference, in units of the middle interval squared.
Eigen::Vector3d second_difference(double before_s, double now_s, double after_s) {
  const double h0 = now_s - before_s, h1 = after_s - now_s, h = (h0 + h1) / 2;
  return {h / h0, -h / h0 - h / h1, h / h1};
}

/// The path's second differences about sample k: of the turn (camera axes) and of the centre (world axes).
Vector6 bend_at(const std::vector<double>& t, const std::vector<MeasuredPose>& poses, std::size_t k) {
  const auto w = second_difference(t[k - 1], t[k], t[k + 1]);
  const auto &a = poses[k - 1].cam_from_world, &b = poses[k].cam_from_world, &c = poses[k + 1].cam_from_world;
  Vector6 bend;
  bend << w[2] * turn_between(b.R, c.R) - w[0] * turn_between(a.R, b.R),
      w[0] * a.centre() + w[1] * b.centre() + w[2] * c.centre();
  return bend;
}

/// (turn, shift) of a pose to (turn, movement of its centre).
Matrix6 to_centre(const RigidTransform& pose) {
  Matrix6 out = Matrix6::Identity();
  out.bottomRightCorner<3, 3>() = -pose.R.transpose();
  return out;
}

struct BendVariance {
  double turn = 0, centre = 0;  ///< per axis: rad², world units²
};

/// Variance of the true second differences: that of the measured ones less that of their noise, by medians.
BendVariance bend_variance(const std::vector<double>& t, const std::vector<MeasuredPose>& poses) {
  const auto is_measured = [&](std::size_t k) { return poses[k].information.determinant() > 0; };
  std::vector<double> turn_bend, centre_bend, turn_noise, centre_noise;
  for (std::size_t k = 1; k + 1 < poses.size(); ++k) {
    if (!is_measured(k - 1) || !is_measured(k) || !is_measured(k + 1)) continue;
    const auto w = second_difference(t[k - 1], t[k], t[k + 1]);
    Matrix6 noise = Matrix6::Zero();
    for (int i = 0; i < 3; ++i) {
      const MeasuredPose& p = poses[k + static_cast<std::size_t>(i) - 1];
      const Matrix6 T = to_centre(p.cam_from_world);
      noise += w[i] * w[i] * T * p.information.inverse() * T.transpose();
    }
    const Vector6 bend = bend_at(t, poses, k);
    turn_bend.push_back(bend.head<3>().squaredNorm());
    centre_bend.push_back(bend.tail<3>().squaredNorm());
    turn_noise.push_back(noise.topLeftCorner<3, 3>().trace() / 3);
    centre_noise.push_back(noise.bottomRightCorner<3, 3>().trace() / 3);
  }
  if (turn_bend.empty()) return {};
  constexpr double kMedianOfChi2 = 2.366;  // of three degrees of freedom
  const auto left = [&](double bend, double noise) {
    return std::max(bend / kMedianOfChi2 - noise, kLeastShare * noise);
  };
  return {left(median(turn_bend), median(turn_noise)), left(median(centre_bend), median(centre_noise))};
}

/// Normal equations of one round in the small corrections (turn, shift) of all poses.
class System {
 public:
  explicit System(std::size_t num) : rhs_(Eigen::VectorXd::Zero(6 * static_cast<Eigen::Index>(num))) {}

  void add(std::size_t i, std::size_t j, const Matrix6& block) {
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c) entries_.emplace_back(index(i) + r, index(j) + c, block(r, c));
  }
  void add_rhs(std::size_t i, const Vector6& v) { rhs_.segment<6>(index(i)) += v; }

  Eigen::VectorXd solve() const {
    Eigen::SparseMatrix<double> N(rhs_.size(), rhs_.size());
    N.setFromTriplets(entries_.begin(), entries_.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(N);
    return solver.info() == Eigen::Success ? Eigen::VectorXd(solver.solve(rhs_)) : Eigen::VectorXd::Zero(rhs_.size());
  }

 private:
  static int index(std::size_t i) { return 6 * static_cast<int>(i); }
  std::vector<Eigen::Triplet<double>> entries_;
  Eigen::VectorXd rhs_;
};

Vector6 deviation(const RigidTransform& from, const RigidTransform& to) {
  Vector6 out;
  out.head<3>() = turn_between(from.R, to.R);
  out.tail<3>() = to.t - to.R * from.R.transpose() * from.t;
  return out;
}

void apply(RigidTransform& pose, const Vector6& correction) {
  const Eigen::Vector3d turn = correction.head<3>();
  if (turn.norm() > 0) {
    const Eigen::Matrix3d by = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    pose.R = (by * pose.R).eval();
    pose.t = (by * pose.t).eval();
  }
  pose.t += correction.tail<3>();
}

void round_of(const std::vector<double>& t, const std::vector<MeasuredPose>& measured, const BendVariance& variance,
              std::vector<MeasuredPose>& poses) {
  System system(poses.size());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    system.add(k, k, measured[k].information);
    system.add_rhs(k, -measured[k].information * deviation(measured[k].cam_from_world, poses[k].cam_from_world));
  }
  Vector6 weights;
  weights << Eigen::Vector3d::Constant(1 / variance.turn), Eigen::Vector3d::Constant(1 / variance.centre);
  for (std::size_t k = 1; k + 1 < poses.size(); ++k) {
    const auto w = second_difference(t[k - 1], t[k], t[k + 1]);
    const Vector6 bend = weights.asDiagonal() * bend_at(t, poses, k);
    for (int i = 0; i < 3; ++i) {
      const std::size_t at = k + static_cast<std::size_t>(i) - 1;
      const Matrix6 J = w[i] * to_centre(poses[at].cam_from_world);
      system.add_rhs(at, -J.transpose() * bend);
      for (int j = 0; j < 3; ++j) {
        const std::size_t other = k + static_cast<std::size_t>(j) - 1;
        system.add(at, other, J.transpose() * weights.asDiagonal() * (w[j] * to_centre(poses[other].cam_from_world)));
      }
    }
  }
  const Eigen::VectorXd step = system.solve();
  for (std::size_t k = 0; k < poses.size(); ++k)
    apply(poses[k].cam_from_world, step.segment<6>(6 * static_cast<Eigen::Index>(k)));
}

}  // namespace

void smooth_path(const std::vector<double>& times_s, std::vector<MeasuredPose>& poses) {
  check(times_s.size() == poses.size(), "every pose has a time");
  if (poses.size() < 4) return;
  const BendVariance variance = bend_variance(times_s, poses);
  if (!(variance.turn > 0 && variance.centre > 0)) return;
  const std::vector<MeasuredPose> measured = poses;
  for (int round = 0; round < kRounds; ++round) round_of(times_s, measured, variance, poses);
}

}  // namespace vantage
