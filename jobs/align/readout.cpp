#include "jobs/align/readout.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace vantage::align {
namespace {

/// Before any pair is asked: half a frame either way.
constexpr double kPriorFrames = 0.5;
/// Tracks of a pair err together: variances by independent runs are this much too small (as for offsets).
constexpr double kCorrelatedTracks = 2.5;

struct System {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

Eigen::Index index_of(std::span<const ShutterCamera> cameras, const std::string& name) {
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const auto& c) { return c.name == name; });
  return found == cameras.end() ? -1 : found - cameras.begin();
}

/// The pairs' offsets are eliminated: each is free.
System assemble(std::span<const PairShutter> pairs, std::span<const ShutterCamera> cameras) {
  const Eigen::Index n = std::ssize(cameras);
  System system{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)};
  for (Eigen::Index k = 0; k < n; ++k) {
    const double prior_s = kPriorFrames * cameras[static_cast<std::size_t>(k)].frame_s;
    system.H(k, k) = 1 / (prior_s * prior_s);
  }
  for (const PairShutter& pair : pairs) {
    const Eigen::Index at[] = {index_of(cameras, pair.a), index_of(cameras, pair.b)};
    if (at[0] < 0 || at[1] < 0 || !(pair.H(0, 0) > 0)) continue;
    const double trust = 1 / (kCorrelatedTracks * kCorrelatedTracks);
    const Eigen::Vector2d to_offset = pair.H.block<2, 1>(1, 0) / pair.H(0, 0);
    const Eigen::Matrix2d H = trust * (pair.H.block<2, 2>(1, 1) - to_offset * pair.H.block<1, 2>(0, 1));
    const Eigen::Vector2d g = trust * (pair.g.tail<2>() - to_offset * pair.g[0]);
    for (int i = 0; i < 2; ++i) {
      system.g[at[i]] += g[i];
      for (int j = 0; j < 2; ++j) system.H(at[i], at[j]) += H(i, j);
    }
  }
  return system;
}

/// H x = g with 0 ≤ x ≤ limits: what leaves its bounds is held there (coordinate descent; H is positive definite).
Eigen::VectorXd solve_bounded(const System& system, const Eigen::VectorXd& limits) {
  constexpr int kSweeps = 500;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(limits.size());
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const double rest = system.g[k] - system.H.row(k).dot(x) + system.H(k, k) * x[k];
      x[k] = std::clamp(rest / system.H(k, k), 0.0, limits[k]);
    }
  return x;
}

}  // namespace

std::vector<Readout> estimate_readouts(std::span<const PairShutter> pairs, std::span<const ShutterCamera> cameras) {
  const System system = assemble(pairs, cameras);
  Eigen::VectorXd limits(std::ssize(cameras));
  for (std::size_t k = 0; k < cameras.size(); ++k) limits[static_cast<Eigen::Index>(k)] = cameras[k].frame_s;
  const Eigen::VectorXd x = solve_bounded(system, limits);
  const Eigen::MatrixXd covariance = system.H.llt().solve(Eigen::MatrixXd::Identity(x.size(), x.size()));
  std::vector<Readout> out;
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    out.push_back({cameras[k].name, x[i], std::sqrt(covariance(i, i))});
  }
  return out;
}

}  // namespace vantage::align
