#include "jobs/sync/nine_points.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numeric>
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
constexpr std::size_t kMaxRefined = 24;
constexpr int kRefinements = 12;
/// Albl et al. 2017, §4.2: b's motion is taken as straight over growing numbers of frames, so that a coarse offset may
/// be frames off; what most samples agree with tells which number to believe.
constexpr int kStepsFrames[] = {1, 2, 4, 8, 16};
constexpr int kMaxRounds = 6;
constexpr double kProgress = 1.02;

using NineSamples = std::vector<MovingSample>;
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
  Eigen::Matrix3d F;
  double support = 0;
  int inliers = 0;
  double share = 0;
};

/// Where b sees the sample so many steps after b0: on its path, not on the chord that the equation takes for it.
std::optional<Eigen::Vector2d> place_at(const MovingSample& s, double fraction, double step_s) {
  return s.path_b ? s.path_b->at(s.time_b_s + fraction * step_s) : s.b0;
}

ScoredRoot score_root(const NineSamples& samples, const SubframeRoot& root, double step_s, double max_px) {
  const std::size_t stride = (samples.size() + kMaxScoredSamples - 1) / kMaxScoredSamples;
  ScoredRoot scored{.fraction = root.fraction, .F = root.F};
  int num_moving = 0;
  for (std::size_t k = 0; k < samples.size(); k += stride) {
    const bool moving = samples[k].path_b != nullptr;
    num_moving += moving ? 1 : 0;
    const auto b = place_at(samples[k], root.fraction, step_s);
    if (!b) continue;
    const double r = std::abs(sampson_px(root.F, samples[k].a, *b)) / max_px;
    scored.support += std::max(0.0, 1 - r * r);
    scored.inliers += moving && r < 1 ? 1 : 0;
  }
  scored.share = num_moving > 0 ? static_cast<double>(scored.inliers) / num_moving : 0;
  return scored;
}

/// Sampson's e and its change with the fraction, b0 and b1 as the equation has them; both over the gradient's length.
struct LinearResidual {
  double r_px = 0, slope_px = 0;
};

LinearResidual residual_of(const Eigen::Matrix3d& F, const MovingSample& s, double fraction) {
  const Eigen::Vector2d b = s.b0 + fraction * (s.b1 - s.b0);
  const double r = sampson_px(F, s.a, b), e = b.homogeneous().dot(F * s.a.homogeneous());
  const Eigen::Vector3d line = F * s.a.homogeneous();
  return {r, e == 0 ? 0 : line.head<2>().dot(s.b1 - s.b0) * r / e};
}

/// M(a) f = 0 in least squares: f of all samples that agree for a given a, a for a given f (Eq. 3 is linear in it), and
/// so on. On a random half of the cells, so that the spread of several such answers is the standard deviation of one
/// from all (delete-half jackknife: Shao & Wu 1989).
void refine_on_half(ScoredRoot& root, const NineSamples& samples, double step_s, double max_px, std::mt19937& random) {
  const auto salt = random();
  NineSamples half;
  for (const MovingSample& s : samples) {
    const bool chosen = s.path_b == nullptr || std::mt19937(salt ^ s.cell)() % 2 == 0;
    if (chosen) half.push_back(s);
  }
  for (int round = 0; round < kRefinements; ++round) {
    std::vector<PointMatch> agreeing;
    double along = 0, square = 0;
    for (const MovingSample& s : half) {
      const auto b = place_at(s, root.fraction, step_s);
      if (b && std::abs(sampson_px(root.F, s.a, *b)) < max_px) agreeing.push_back({s.a, *b});
    }
    std::vector<Eigen::Vector2d> points_a, points_b;
    for (const PointMatch& m : agreeing) points_a.push_back(m.a), points_b.push_back(m.b);
    if (agreeing.size() < kMinSamples) return;
    const std::vector<double> equal(agreeing.size(), 1);
    root.F = *eight_point(agreeing, equal, hartley_normalisation(points_a), hartley_normalisation(points_b));
    for (const MovingSample& s : half) {
      const LinearResidual r = residual_of(root.F, s, root.fraction);
      if (std::abs(r.r_px) >= max_px) continue;
      along += r.slope_px * r.r_px;
      square += r.slope_px * r.slope_px;
    }
    if (square > 0) root.fraction -= std::clamp(along / square, -0.5, 0.5);
  }
}

std::vector<ScoredRoot> roots_of_group(const NineSamples& samples, int draws, double step_s, double max_px,
                                       std::mt19937& random) {
  std::vector<ScoredRoot> roots;
  for (int draw = 0; draw < draws; ++draw)
    for (const SubframeRoot& root : solve_nine_points(draw_from<9>(std::span(samples), random), kMaxFraction))
      roots.push_back(score_root(samples, root, step_s, max_px));
  double best = 0;
  for (const ScoredRoot& r : roots) best = std::max(best, r.support);
  std::erase_if(roots, [&](const ScoredRoot& r) { return r.inliers <= 9 || r.support < kNearlyBest * best; });
  std::stable_sort(roots.begin(), roots.end(), [](auto& p, auto& q) { return p.support > q.support; });
  if (roots.size() > kMaxRefined) roots.resize(kMaxRefined);
  for (ScoredRoot& root : roots) refine_on_half(root, samples, step_s, max_px, random);
  return roots;
}

/// Highest point of the roots' density (Gaussian kernel), and the weighted spread about it.
SubframeVote mode_of(const std::vector<ScoredRoot>& roots) {
  SubframeVote vote;
  double highest = -1;
  for (double x = -kMaxFraction; x <= kMaxFraction; x += 0.005) {
    double density = 0;
    for (const auto& r : roots) density += r.support * std::exp(-0.5 * std::pow((r.fraction - x) / kModeWidth, 2));
    if (density > highest) highest = density, vote.fraction = x;
  }
  double weight = 0, shift = 0, square = 0, total = 0;
  for (const auto& r : roots) {
    const double d = r.fraction - vote.fraction;
    vote.num_inliers = std::max(vote.num_inliers, r.inliers);
    vote.inlier_share = std::max(vote.inlier_share, r.share);
    vote.support = std::max(vote.support, r.support);
    total += r.support;
    if (std::abs(d) > 3 * kModeWidth) continue;
    weight += r.support;
    shift += r.support * d;
    square += r.support * d * d;
  }
  vote.num_roots = static_cast<int>(roots.size());
  // Roots that agree with the data yet lie elsewhere say that the mode is no sharper than they are far.
  vote.std = std::sqrt(square / weight) + kMaxFraction * std::max(0.0, 0.5 - weight / total);
  vote.fraction += shift / weight;
  return vote;
}

/// One frame of the footage of a in the paper's own way: the roots of some nines, none asked how well it fits the rest.
std::vector<double> raw_roots(const NineSamples& samples, std::mt19937& random) {
  constexpr int kNinesPerFrame = 8;
  std::vector<double> roots;
  for (int draw = 0; draw < kNinesPerFrame; ++draw)
    for (const SubframeRoot& root : solve_nine_points(draw_from<9>(std::span(samples), random), 1))
      if (root.fraction >= 0) roots.push_back(root.fraction);
  return roots;
}

/// Neighbouring points err together: shading, perspective, a thing's bending.
unsigned cell_of(const TimedTrack& track) {
  constexpr double kCellPx = 40;
  const Eigen::Vector2d& px = track.px(track.size() / 2);
  return static_cast<unsigned>(std::lround(px.x() / kCellPx) * 65536 + std::lround(px.y() / kCellPx));
}

std::vector<NineSamples> samples_at(const NinePointInput& in, double offset_s, double step_s, bool one_geometry) {
  std::vector<NineSamples> groups(one_geometry ? 1 : in.table_a.pts_s.size());
  for (const PathPair& pair : in.pairs) {
    const unsigned cell = cell_of(pair.a);
    for (std::size_t k = 0; k < pair.a.size(); ++k) {
      const double time_b_s = pair.a.time_s(k) - offset_s;
      const auto b0 = pair.b.at(time_b_s), b1 = pair.b.at(time_b_s + step_s);
      if (!b0 || !b1) continue;
      const std::size_t group = one_geometry ? 0 : static_cast<std::size_t>(pair.a.first_frame) + k;
      groups[group].push_back({pair.a.px(k), *b0, *b1, &pair.b, time_b_s, cell});
    }
  }
  for (NineSamples& group : groups) {
    const std::size_t num_still = std::min(in.still.size(), group.size());
    for (std::size_t k = 0; k < num_still; ++k) group.push_back({in.still[k].a, in.still[k].b, in.still[k].b});
  }
  return groups;
}

std::optional<SubframeVote> vote_at(const NinePointInput& in, double offset_s, double step_s) {
  const auto groups = samples_at(in, offset_s, step_s, in.static_cameras);
  const auto num_usable =
      std::count_if(groups.begin(), groups.end(), [](const NineSamples& g) { return g.size() >= kMinSamples; });
  if (num_usable == 0) return std::nullopt;
  const int draws = std::max(kMinDrawsPerGroup, kTotalDraws / static_cast<int>(num_usable));
  std::mt19937 random(9);
  std::vector<ScoredRoot> roots;
  for (const NineSamples& group : groups) {
    if (group.size() < kMinSamples) continue;
    const auto more = roots_of_group(group, draws, step_s, in.max_px, random);
    roots.insert(roots.end(), more.begin(), more.end());
  }
  if (roots.empty()) return std::nullopt;
  SubframeVote vote = mode_of(roots);
  vote.offset_s = offset_s - vote.fraction * step_s;
  vote.std_s = vote.std * step_s;
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
    const bool finite = std::abs(beta) > 0 && std::abs(alpha) <= max_fraction * std::abs(beta);
    if (!finite || std::abs(alpha.imag()) > 1e-6 * std::abs(beta)) continue;
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

std::optional<SubframeVote> align_by_nine_points(const NinePointInput& in, double coarse_offset_s) {
  std::optional<SubframeVote> best = vote_at(in, coarse_offset_s, in.frame_b_s);
  for (int round = 0; round < kMaxRounds; ++round) {
    const double at_s = best ? best->offset_s : coarse_offset_s;
    std::optional<SubframeVote> better;
    for (const int step : kStepsFrames) {
      const auto vote = vote_at(in, at_s, step * in.frame_b_s);
      if (vote && (!better || vote->support > better->support)) better = vote;
    }
    if (!better || (best && better->support < kProgress * best->support)) break;
    best = better;
  }
  return best ? vote_at(in, best->offset_s, in.frame_b_s) : std::nullopt;
}

std::optional<MeanOfRoots> mean_of_roots(const NinePointInput& in, double coarse_offset_s) {
  std::mt19937 random(9);
  std::vector<double> means;
  const double frame_s = std::ceil(coarse_offset_s / in.frame_b_s) * in.frame_b_s;
  for (const NineSamples& group : samples_at(in, frame_s, in.frame_b_s, false)) {
    if (group.size() < kMinSamples) continue;
    const std::vector<double> roots = raw_roots(group, random);
    if (roots.empty()) continue;
    means.push_back(std::accumulate(roots.begin(), roots.end(), 0.0) / static_cast<double>(roots.size()));
  }
  if (means.size() < 2) return std::nullopt;
  const auto n = static_cast<double>(means.size());
  const double mean = std::accumulate(means.begin(), means.end(), 0.0) / n;
  double square = 0;
  for (const double m : means) square += (m - mean) * (m - mean);
  return MeanOfRoots{frame_s - mean * in.frame_b_s, std::sqrt(square / (n - 1) / n) * in.frame_b_s,
                     static_cast<int>(means.size())};
}

}  // namespace vantage::sync
