#include "jobs/sync/nine_points.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <random>

#include "jobs/sync/fundamental_fit.h"
#include "jobs/sync/random_draw.h"
#include "schema/base/error.h"

namespace vantage::sync {
namespace {

constexpr double kMaxFraction = 2;
constexpr int kTotalDraws = 600;
constexpr int kMinDrawsPerGroup = 40;
constexpr std::size_t kMinSamples = 12;
constexpr std::size_t kMaxScoredSamples = 400;
/// Roots with fewer than this share of the best root's inliers have no vote.
constexpr double kNearlyBest = 0.85;
constexpr double kModeWidth = 0.05;

using Vector9 = Eigen::Matrix<double, 9, 1>;
using Matrix9 = Eigen::Matrix<double, 9, 9>;

/// Row of b ⊗ a: the coefficients of F's entries, row by row.
Vector9 row_of(const Eigen::Vector3d& b, const Eigen::Vector3d& a) {
  Vector9 row;
  row << b.x() * a, b.y() * a, b.z() * a;
  return row;
}

struct ScoredRoot {
  double fraction = 0;
  int inliers = 0;
  double share = 0;
};

ScoredRoot score_root(const std::vector<MovingSample>& samples, const SubframeRoot& root, double max_px) {
  const std::size_t stride = (samples.size() + kMaxScoredSamples - 1) / kMaxScoredSamples;
  int inliers = 0, looked_at = 0;
  for (std::size_t k = 0; k < samples.size(); k += stride, ++looked_at) {
    const MovingSample& s = samples[k];
    inliers += std::abs(sampson_px(root.F, s.a, s.b0 + root.fraction * (s.b1 - s.b0))) < max_px ? 1 : 0;
  }
  return {root.fraction, inliers, static_cast<double>(inliers) / looked_at};
}

std::vector<ScoredRoot> roots_of_group(const std::vector<MovingSample>& samples, int draws, double max_px,
                                       std::mt19937& random) {
  std::vector<ScoredRoot> roots;
  int best = 0;
  for (int draw = 0; draw < draws; ++draw)
    for (const SubframeRoot& root : solve_nine_points(draw_from<9>(std::span(samples), random), kMaxFraction)) {
      roots.push_back(score_root(samples, root, max_px));
      best = std::max(best, roots.back().inliers);
    }
  std::erase_if(roots, [&](const ScoredRoot& r) { return r.inliers <= 9 || r.inliers < kNearlyBest * best; });
  return roots;
}

/// Highest point of the roots' density (Gaussian kernel), and the weighted spread about it.
SubframeVote mode_of(const std::vector<ScoredRoot>& roots) {
  SubframeVote vote;
  double highest = -1;
  for (double x = -kMaxFraction; x <= kMaxFraction; x += 0.005) {
    double density = 0;
    for (const auto& r : roots) density += r.inliers * std::exp(-0.5 * std::pow((r.fraction - x) / kModeWidth, 2));
    if (density > highest) highest = density, vote.fraction = x;
  }
  double weight = 0, shift = 0, square = 0;
  for (const auto& r : roots) {
    const double d = r.fraction - vote.fraction;
    vote.num_inliers = std::max(vote.num_inliers, r.inliers);
    vote.inlier_share = std::max(vote.inlier_share, r.share);
    if (std::abs(d) > 3 * kModeWidth) continue;
    weight += r.inliers;
    shift += r.inliers * d;
    square += r.inliers * d * d;
  }
  double outside = 0, total = 0;
  for (const auto& r : roots) {
    total += r.inliers;
    outside += std::abs(r.fraction - vote.fraction) > 3 * kModeWidth ? r.inliers : 0;
  }
  vote.num_roots = static_cast<int>(roots.size());
  // Roots that agree with the data yet lie elsewhere say that the mode is no sharper than they are far.
  vote.std = std::sqrt(square / weight) + kMaxFraction * std::max(0.0, outside / total - 0.5);
  vote.fraction += shift / weight;
  return vote;
}

}  // namespace

std::vector<SubframeRoot> solve_nine_points(std::span<const MovingSample> nine, double max_fraction) {
  check(nine.size() == 9, "det M(a) = 0 is about nine samples");
  std::vector<Eigen::Vector2d> points_a, points_b;
  for (const auto& s : nine) {
    points_a.push_back(s.a);
    points_b.push_back(s.b0);
    points_b.push_back(s.b1);
  }
  const Eigen::Matrix3d Ta = hartley_normalisation(points_a), Tb = hartley_normalisation(points_b);
  Matrix9 A, B;
  for (Eigen::Index k = 0; k < 9; ++k) {
    const MovingSample& s = nine[static_cast<std::size_t>(k)];
    const Eigen::Vector3d a = Ta * s.a.homogeneous(), b0 = Tb * s.b0.homogeneous(), b1 = Tb * s.b1.homogeneous();
    A.row(k) = row_of(b0, a).transpose();
    B.row(k) = row_of(b1 - b0, a).transpose();
  }
  // A f = fraction (-B) f. B is singular (its points lie at infinity): those eigenvalues have beta = 0.
  const Eigen::GeneralizedEigenSolver<Matrix9> solver(A, -B, false);
  std::vector<SubframeRoot> roots;
  if (solver.info() != Eigen::Success) return roots;
  for (Eigen::Index k = 0; k < 9; ++k) {
    const std::complex<double> alpha = solver.alphas()[k];
    const double beta = solver.betas()[k];
    if (std::abs(alpha) > max_fraction * std::abs(beta) || std::abs(alpha.imag()) > 1e-6 * std::abs(beta)) continue;
    const double fraction = alpha.real() / beta;
    const Eigen::JacobiSVD<Matrix9> svd(A + fraction * B, Eigen::ComputeFullV);
    const Vector9 f = svd.matrixV().col(8);
    Eigen::Matrix3d F;
    F << f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8];
    F = Tb.transpose() * F * Ta;
    roots.push_back({fraction, F / F.norm()});
  }
  return roots;
}

std::optional<SubframeVote> vote_subframe(const std::vector<std::vector<MovingSample>>& groups, double max_px) {
  std::vector<const std::vector<MovingSample>*> usable;
  for (const auto& group : groups)
    if (group.size() >= kMinSamples) usable.push_back(&group);
  if (usable.empty()) return std::nullopt;
  const int draws = std::max(kMinDrawsPerGroup, kTotalDraws / static_cast<int>(usable.size()));
  std::mt19937 random(9);
  std::vector<ScoredRoot> roots;
  for (const auto* group : usable) {
    const auto more = roots_of_group(*group, draws, max_px, random);
    roots.insert(roots.end(), more.begin(), more.end());
  }
  if (roots.empty()) return std::nullopt;
  return mode_of(roots);
}

std::vector<std::vector<MovingSample>> moving_samples(const std::vector<PathPair>& pairs, const FrameTable& table_a,
                                                      double coarse_offset_s, double frame_b_s, bool static_cameras) {
  std::vector<std::vector<MovingSample>> groups(static_cameras ? 1 : table_a.pts_s.size());
  for (const PathPair& pair : pairs)
    for (std::size_t k = 0; k < pair.a.size(); ++k) {
      const double time_b = pair.a.time_s(k) - coarse_offset_s;
      const auto b0 = pair.b.at(time_b), b1 = pair.b.at(time_b + frame_b_s);
      if (!b0 || !b1) continue;
      const std::size_t group = static_cameras ? 0 : static_cast<std::size_t>(pair.a.first_frame) + k;
      groups[group].push_back({pair.a.px(k), *b0, *b1});
    }
  return groups;
}

}  // namespace vantage::sync
