#include "jobs/sync/epipolar_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace vantage::sync {
namespace {

constexpr int kMaxIterations = 60;
constexpr std::size_t kMinSamples = 4;
constexpr double kCauchyScale = 2;
// Bounds of the estimated noise: KLT is never better than the first nor its matches worth much beyond the last.
constexpr double kMinNoisePx = 0.1, kMaxNoisePx = 2, kMinBiasPx = 0.1, kMaxBiasPx = 4;
constexpr double kDerivativeStepS = 1e-3;

struct Residuals {
  std::vector<double> r_px;
  std::vector<Eigen::Vector2d> J;  // d r / d (offset, rate), px per s and px
};

Residuals residuals_of(const PathPair& pair, const PairGeometry& geometry, double offset_s, double rate,
                       double max_px) {
  Residuals out;
  for (std::size_t k = 0; k < pair.a.size(); ++k) {
    const double time_a = pair.a.time_s(k), time_b = (time_a - offset_s) / rate;
    const double before = std::max(time_b - kDerivativeStepS, pair.b.begin_s()),
                 after = std::min(time_b + kDerivativeStepS, pair.b.end_s());
    const auto here = pair.b.at(time_b), px_before = pair.b.at(before), px_after = pair.b.at(after);
    if (!here || !px_before || !px_after || after <= before) continue;
    const auto r = geometry.residual_px(pair.a.px(k), time_a, *here, time_b);
    const auto r_before = geometry.residual_px(pair.a.px(k), time_a, *px_before, before);
    const auto r_after = geometry.residual_px(pair.a.px(k), time_a, *px_after, after);
    if (!r || !r_before || !r_after || std::abs(*r) > max_px) continue;
    const double slope = (*r_after - *r_before) / (after - before);
    out.r_px.push_back(*r);
    out.J.emplace_back(-slope / rate, -slope * time_b / rate);
  }
  return out;
}

double mean(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x;
  return sum / static_cast<double>(v.size());
}

/// Standard deviation from the median of absolute values.
double robust_std(std::vector<double> deviations, double fallback) {
  if (deviations.empty()) return fallback;
  for (double& d : deviations) d = std::abs(d);
  const auto middle = deviations.begin() + static_cast<std::ptrdiff_t>(deviations.size() / 2);
  std::nth_element(deviations.begin(), middle, deviations.end());
  return 1.4826 * *middle;
}

struct Noise {
  double sample_px = 1, bias_px = kMaxBiasPx;
};

Noise estimate_noise(const std::vector<Residuals>& all) {
  std::vector<double> within, means;
  for (const Residuals& res : all) {
    means.push_back(mean(res.r_px));
    for (const double r : res.r_px) within.push_back(r - means.back());
  }
  return {std::clamp(robust_std(within, 1), kMinNoisePx, kMaxNoisePx),
          std::clamp(robust_std(means, kMaxBiasPx), kMinBiasPx, kMaxBiasPx)};
}

/// One pair's part of the normal equations, with the inverse covariance by Sherman and Morrison.
struct PairTerm {
  Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
  Eigen::Vector2d g = Eigen::Vector2d::Zero();
  double chi2 = 0;
  std::size_t num = 0;
  double weight = 0;
};

PairTerm term_of(const Residuals& res, const Noise& noise) {
  const double s2 = noise.sample_px * noise.sample_px, b2 = noise.bias_px * noise.bias_px;
  const auto n = static_cast<double>(res.r_px.size());
  const double shrink = b2 / (s2 + n * b2);
  PairTerm term{.num = res.r_px.size()};
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
  term.weight = 1 / (1 + term.chi2 / n / (kCauchyScale * kCauchyScale));
  return term;
}

struct System {
  std::vector<PairTerm> terms;
  Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
  Eigen::Vector2d g = Eigen::Vector2d::Zero();
  Noise noise;
};

System build_system(const std::vector<PathPair>& pairs, const PairGeometry& geometry, double offset_s, double rate,
                    const FitOptions& options) {
  std::vector<Residuals> all;
  for (const PathPair& pair : pairs) {
    Residuals res = residuals_of(pair, geometry, offset_s, rate, options.max_epipolar_px);
    if (res.r_px.size() >= kMinSamples) all.push_back(std::move(res));
  }
  System system{.terms = {}, .noise = estimate_noise(all)};
  for (const Residuals& res : all) {
    PairTerm term = term_of(res, system.noise);
    system.H += term.weight * term.H;
    system.g += term.weight * term.g;
    system.terms.push_back(std::move(term));
  }
  if (!options.estimate_rate) {  // pins the rate: its row and column tell nothing of the offset
    system.H(0, 1) = system.H(1, 0) = system.g[1] = 0;
    system.H(1, 1) = 1;
  }
  return system;
}

Eigen::Matrix2d covariance_of(const System& system, bool estimate_rate) {
  const Eigen::Matrix2d inverse = system.H.inverse();
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  double chi2 = 0, num = 0;
  for (const PairTerm& term : system.terms) {
    Eigen::Vector2d score = term.weight * term.g;
    if (!estimate_rate) score[1] = 0;
    spread += score * score.transpose();
    chi2 += term.weight * term.chi2;
    num += term.weight * static_cast<double>(term.num);
  }
  const Eigen::Matrix2d fisher = inverse * std::max(1.0, chi2 / std::max(num, 1.0));
  const Eigen::Matrix2d sandwich = inverse * spread * inverse;
  return sandwich(0, 0) > fisher(0, 0) ? sandwich : fisher;
}

OffsetFit summarise(const System& system, double offset_s, double rate, const FitOptions& options) {
  const Eigen::Matrix2d covariance = covariance_of(system, options.estimate_rate);
  OffsetFit fit{.offset_s = offset_s, .rate = rate, .std_s = std::sqrt(covariance(0, 0))};
  if (options.estimate_rate) fit.rate_std = std::sqrt(covariance(1, 1));
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

}  // namespace

std::optional<OffsetFit> fit_offset(const std::vector<PathPair>& pairs, const PairGeometry& geometry,
                                    double start_offset_s, double max_step_s, const FitOptions& options) {
  double offset_s = start_offset_s, rate = 1;
  System system = build_system(pairs, geometry, offset_s, rate, options);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    if (system.terms.empty() || !(system.H.determinant() > 1e-9)) return std::nullopt;
    Eigen::Vector2d step = -system.H.ldlt().solve(system.g);
    step[0] = std::clamp(step[0], -0.25 * max_step_s, 0.25 * max_step_s);
    offset_s += step[0];
    rate += step[1];
    if (std::abs(offset_s - start_offset_s) > max_step_s || std::abs(rate - 1) > 0.05) return std::nullopt;
    system = build_system(pairs, geometry, offset_s, rate, options);
    if (std::abs(step[0]) < 1e-7) break;
  }
  if (system.terms.empty() || !(system.H.determinant() > 1e-9)) return std::nullopt;
  return summarise(system, offset_s, rate, options);
}

}  // namespace vantage::sync
