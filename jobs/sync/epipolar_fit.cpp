#include "jobs/sync/epipolar_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "jobs/sync/cluster_jackknife.h"
#include "schema/base/median.h"

namespace vantage::sync {
namespace {

constexpr int kMaxIterations = 60;
constexpr std::size_t kMinSamples = 4;
constexpr double kCauchyScale = 2;
// KLT is never better.
constexpr double kMinNoisePx = 0.1, kMinBiasPx = 0.1;
constexpr double kDerivativeStepS = 1e-3;
/// No calibration and no two paths of a point are better than this, and all pairs of two cameras may share it.
constexpr double kSharedBiasPx = 0.1;

Cluster cluster_of(const PathPair& pair, const PairGeometry& geometry) {
  const std::size_t middle = pair.a.size() / 2;
  return cluster_at(pair.a.px(middle), pair.a.time_s(middle), geometry.width_a_px());
}

struct Residuals {
  Cluster cluster{};
  std::vector<double> r_px;
  std::vector<Eigen::Vector2d> J;                        // d r / d (offset, rate), px per s and px
  Eigen::Matrix2d noise_in_J = Eigen::Matrix2d::Zero();  // sum of J J^T that a pixel of noise alone would give
};

Residuals residuals_of(const PathPair& pair, const PairGeometry& geometry, double offset_s, double rate,
                       double max_px) {
  Residuals out;
  for (std::size_t k = 0; k < pair.a.size(); ++k) {
    const double time_a = pair.a.time_s(k), time_b = (time_a - offset_s) / rate;
    const auto here = pair.b.at(time_b);
    if (!here) continue;
    const TimedTrack::Velocity velocity = pair.b.velocity_at(time_b);
    const Eigen::Vector2d moved = kDerivativeStepS * velocity.px_per_s;
    const auto r = geometry.residual_px(pair.a.px(k), time_a, *here, time_b);
    const auto r_before = geometry.residual_px(pair.a.px(k), time_a, *here - moved, time_b - kDerivativeStepS);
    const auto r_after = geometry.residual_px(pair.a.px(k), time_a, *here + moved, time_b + kDerivativeStepS);
    if (!r || !r_before || !r_after || std::abs(*r) > max_px) continue;
    const double slope = (*r_after - *r_before) / (2 * kDerivativeStepS);
    const Eigen::Vector2d d_time(-1 / rate, -time_b / rate);  // of time_b by the unknowns
    out.r_px.push_back(*r);
    out.J.push_back(slope * d_time);
    out.noise_in_J += velocity.std_per_px * velocity.std_per_px * d_time * d_time.transpose();
  }
  return out;
}

double mean(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x;
  return sum / static_cast<double>(v.size());
}

struct Noise {
  double sample_px = 1, bias_px = 1;
};

Noise estimate_noise(const std::vector<Residuals>& all, const FitOptions& options) {
  std::vector<double> within, means;
  for (const Residuals& res : all) {
    means.push_back(mean(res.r_px));
    for (const double r : res.r_px) within.push_back(r - means.back());
  }
  return {std::clamp(robust_std(within, 1), kMinNoisePx, options.max_noise_px),
          std::clamp(robust_std(means, options.max_bias_px), kMinBiasPx, options.max_bias_px)};
}

/// One pair's part of the normal equations, with the inverse covariance by Sherman and Morrison.
struct PairTerm {
  Cluster cluster{};
  Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d H_noise = Eigen::Matrix2d::Zero();  // what of H is not motion but noise: r's, in units of itself
  Eigen::Vector2d g = Eigen::Vector2d::Zero();
  double chi2 = 0;
  Eigen::Vector2d g_of_bias = Eigen::Vector2d::Zero();  // what a pixel in all of its residuals adds to g
  std::size_t num = 0;
  double weight = 0;
};

PairTerm term_of(const Residuals& res, const Noise& noise) {
  const double s2 = noise.sample_px * noise.sample_px, b2 = noise.bias_px * noise.bias_px;
  const auto n = static_cast<double>(res.r_px.size());
  const double shrink = b2 / (s2 + n * b2);
  PairTerm term{.cluster = res.cluster, .H_noise = res.noise_in_J, .num = res.r_px.size()};
  Eigen::Vector2d sum_J = Eigen::Vector2d::Zero();
  double sum_r = 0;
  for (std::size_t k = 0; k < res.r_px.size(); ++k) {
    term.H += res.J[k] * res.J[k].transpose() / s2;
    term.g += res.J[k] * res.r_px[k] / s2;
    term.chi2 += res.r_px[k] * res.r_px[k] / s2;
    sum_J += res.J[k];
    sum_r += res.r_px[k];
  }
  term.H -= shrink / s2 * sum_J * sum_J.transpose();
  term.g -= shrink / s2 * sum_J * sum_r;
  term.chi2 -= shrink / s2 * sum_r * sum_r;
  term.g_of_bias = (1 - n * shrink) / s2 * sum_J;
  term.weight = 1 / (1 + term.chi2 / n / (kCauchyScale * kCauchyScale));
  return term;
}

/// Whether there is more in H than noise would put there: else nothing tells time.
constexpr double kMinInformation = 0.3;

struct System {
  std::vector<PairTerm> terms;
  Eigen::Matrix2d H = Eigen::Matrix2d::Zero(), H_noise = Eigen::Matrix2d::Zero();
  Eigen::Vector2d g = Eigen::Vector2d::Zero();
  double pivot_b_s = 0;
  Noise noise;
};

System build_system(const std::vector<PathPair>& pairs, const PairGeometry& geometry, double offset_s, double rate,
                    const FitOptions& options) {
  std::vector<Residuals> all;
  for (const PathPair& pair : pairs) {
    Residuals res = residuals_of(pair, geometry, offset_s, rate, options.max_epipolar_px);
    if (res.r_px.size() < kMinSamples) continue;
    res.cluster = cluster_of(pair, geometry);
    all.push_back(std::move(res));
  }
  System system{.terms = {}, .noise = estimate_noise(all, options)};
  for (const Residuals& res : all) {
    PairTerm term = term_of(res, system.noise);
    system.H += term.weight * term.H;
    system.g += term.weight * term.g;
    system.H_noise += term.weight * term.H_noise;
    system.terms.push_back(std::move(term));
  }
  if (system.H(0, 0) > 0) system.pivot_b_s = system.H(0, 1) / system.H(0, 0);
  if (!options.estimate_rate) {  // pins the rate: its row and column tell nothing of the offset
    system.H(0, 1) = system.H(1, 0) = system.g[1] = 0;
    system.H(1, 1) = 1;
    system.H_noise(0, 1) = system.H_noise(1, 0) = system.H_noise(1, 1) = 0;
  }
  return system;
}

ClusterParts parts_of(const System& system, bool estimate_rate) {
  ClusterParts parts;
  for (const PairTerm& term : system.terms) {
    Eigen::Matrix2d H = term.weight * term.H;
    Eigen::Vector2d g = term.weight * term.g;
    if (!estimate_rate) H(0, 1) = H(1, 0) = H(1, 1) = g[1] = 0;
    add_part(parts, term.cluster, H, g);
  }
  return parts;
}

/// How far a shared error of kSharedBiasPx moves the answer.
Eigen::Vector2d moved_by_shared_bias(const System& system, bool estimate_rate) {
  Eigen::Vector2d g = Eigen::Vector2d::Zero();
  for (const PairTerm& term : system.terms) g += kSharedBiasPx * term.weight * term.g_of_bias;
  if (!estimate_rate) g[1] = 0;
  return system.H.ldlt().solve(g);
}

Eigen::Matrix2d fisher_covariance(const System& system) {
  double chi2 = 0, num = 0;
  for (const PairTerm& term : system.terms) {
    chi2 += term.weight * term.chi2;
    num += term.weight * static_cast<double>(term.num);
  }
  return system.H.inverse() * std::max(1.0, chi2 / std::max(num, 1.0));
}

Eigen::Matrix2d covariance_of(const System& system, bool estimate_rate) {
  const ClusterParts parts = parts_of(system, estimate_rate);
  const Eigen::Matrix2d fisher = fisher_covariance(system), jackknife = jackknife_covariance(parts, system.H);
  // Noise adds to H what is not information: scale by how little of H is.
  const Eigen::Matrix2d dilution = (system.H - system.H_noise).inverse() * system.H;
  const double factor = student_factor(effective_clusters(parts, Eigen::Vector2d::UnitX()) - (estimate_rate ? 2 : 1));
  const Eigen::Matrix2d& larger = jackknife(0, 0) > fisher(0, 0) ? jackknife : fisher;
  const Eigen::Vector2d moved = moved_by_shared_bias(system, estimate_rate);
  return dilution * (factor * factor * larger + moved * moved.transpose()) * dilution.transpose();
}

OffsetFit summarise(const System& system, double offset_s, double rate, const FitOptions& options) {
  const Eigen::Matrix2d covariance = covariance_of(system, options.estimate_rate);
  OffsetFit fit{.offset_s = offset_s, .rate = rate, .std_s = std::sqrt(covariance(0, 0))};
  fit.pivot_b_s = system.pivot_b_s;
  if (options.estimate_rate) {
    fit.rate_std = std::sqrt(covariance(1, 1));
    fit.pivot_b_s = -covariance(0, 1) / covariance(1, 1);
    fit.std_s = std::sqrt(covariance(0, 0) + fit.pivot_b_s * covariance(0, 1));
  }
  fit.noise_px = system.noise.sample_px;
  fit.bias_px = system.noise.bias_px;
  double sum = 0, sum_squares = 0;
  for (const PairTerm& term : system.terms) {
    const double information = term.weight * term.H(0, 0);
    sum += information;
    sum_squares += information * information;
    fit.num_tracks += term.weight > 0.5 ? 1 : 0;
  }
  fit.effective_tracks = sum_squares > 0 ? sum * sum / sum_squares : 0;
  return fit;
}

bool tells_time(const System& system) {
  if (system.terms.empty() || !(system.H.determinant() > 1e-9)) return false;
  return system.H_noise(0, 0) < (1 - kMinInformation) * system.H(0, 0) && (system.H - system.H_noise).determinant() > 0;
}

}  // namespace

std::optional<OffsetFit> fit_offset(const std::vector<PathPair>& pairs, const PairGeometry& geometry,
                                    double start_offset_s, double max_step_s, const FitOptions& options) {
  double offset_s = start_offset_s, rate = 1;
  System system = build_system(pairs, geometry, offset_s, rate, options);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    if (!tells_time(system)) return std::nullopt;
    Eigen::Vector2d step = -system.H.ldlt().solve(system.g);
    step[0] = std::clamp(step[0], -0.25 * max_step_s, 0.25 * max_step_s);
    offset_s += step[0];
    rate += step[1];
    if (std::abs(offset_s - start_offset_s) > max_step_s || std::abs(rate - 1) > 0.05) return std::nullopt;
    system = build_system(pairs, geometry, offset_s, rate, options);
    if (std::abs(step[0]) < 1e-7) break;
  }
  if (!tells_time(system)) return std::nullopt;
  return summarise(system, offset_s, rate, options);
}

std::optional<OffsetFit> fit_clock(const std::vector<PathPair>& pairs, const PairGeometry& geometry,
                                   double start_offset_s, double frame_s, double overlap_s, const FitOptions& options) {
  constexpr double kMaxStepFrames = 2, kMaxRateErrorFrames = 0.5;
  const auto fit = fit_offset(pairs, geometry, start_offset_s, kMaxStepFrames * frame_s, options);
  if (!fit) return fit;
  FitOptions with_rate = options;
  with_rate.estimate_rate = true;
  const auto clock = fit_offset(pairs, geometry, fit->offset_s, kMaxStepFrames * frame_s, with_rate);
  return clock && clock->rate_std * overlap_s < kMaxRateErrorFrames * frame_s ? clock : fit;
}

}  // namespace vantage::sync
