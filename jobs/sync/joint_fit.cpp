#include "jobs/sync/joint_fit.h"

#include <ceres/ceres.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "jobs/sync/clock_information.h"
#include "jobs/sync/free_scan.h"
#include "jobs/sync/joint_problem.h"
#include "jobs/sync/pair_geometry.h"
#include "schema/base/median.h"

namespace vantage::sync {
namespace {

constexpr double kRunS = 2;
constexpr std::size_t kMinRunSamples = 3;
constexpr std::size_t kMaxSamples = 4000;
constexpr double kWidthsPx[] = {6, 3, 1.5};
/// Bounds of the estimated noise: as for pairs with known cameras, no track is better nor worth much beyond.
constexpr double kMinNoisePx = 0.1, kMaxNoisePx = 2, kMinBiasPx = 0.1, kMaxBiasPx = 4;
constexpr double kGate = 3;
/// A fit goes no farther from its start.
constexpr double kReachS = 1;

/// Samples that b sees and that lie within the gate, as the present estimate has it.
std::vector<PathRun> runs_within(const std::vector<PathRun>& runs, const std::vector<PathPair>& pairs,
                                 const JointState& state, double gate_px) {
  const Eigen::Matrix3d F = state.fundamental();
  std::vector<PathRun> out;
  for (const PathRun& run : runs) {
    PathRun kept{run.pair, {}, {}};
    for (std::size_t k = 0; k < run.a.size(); ++k) {
      const auto b = pairs[run.pair].b.at(state.time_b_s(run.times_a_s[k]));
      if (!b || std::abs(sampson_px(F, run.a[k], *b)) > gate_px) continue;
      kept.times_a_s.push_back(run.times_a_s[k]);
      kept.a.push_back(run.a[k]);
    }
    if (kept.a.size() >= kMinRunSamples) out.push_back(std::move(kept));
  }
  return out;
}

RunNoise estimate_noise(const std::vector<PathRun>& runs, const std::vector<PathPair>& pairs, const JointState& state) {
  const Eigen::Matrix3d F = state.fundamental();
  std::vector<double> within, means;
  for (const PathRun& run : runs) {
    std::vector<double> r;
    double mean = 0;
    for (std::size_t k = 0; k < run.a.size(); ++k) {
      r.push_back(sampson_px(F, run.a[k], *pairs[run.pair].b.at(state.time_b_s(run.times_a_s[k]))));
      mean += r.back() / static_cast<double>(run.a.size());
    }
    for (const double x : r) within.push_back(x - mean);
    means.push_back(mean);
  }
  return {std::clamp(robust_std(within, 1), kMinNoisePx, kMaxNoisePx),
          std::clamp(robust_std(means, kMaxBiasPx), kMinBiasPx, kMaxBiasPx)};
}

JointFit summarise(const JointState& state, const RunNoise& noise, const ClockInformation& information,
                   bool estimate_rate) {
  JointFit fit{.clock = {}, .F = state.fundamental()};
  const Eigen::Matrix2d& C = information.covariance;
  const double to_independent_s = estimate_rate ? C(0, 1) / C(1, 1) : 0;
  fit.clock.offset_s = state.offset_s();
  fit.clock.rate = state.rate();
  fit.clock.pivot_b_s = state.pivot_b_s - to_independent_s;
  fit.clock.std_s = std::sqrt(C(0, 0) - to_independent_s * C(0, 1));
  fit.clock.rate_std = estimate_rate ? std::sqrt(C(1, 1)) : 0;
  fit.clock.noise_px = noise.sample_px;
  fit.clock.bias_px = noise.bias_px;
  fit.clock.effective_tracks = information.effective_runs;
  fit.clock.num_tracks = information.num_believed_runs;
  return fit;
}

}  // namespace

std::vector<PathRun> cut_into_runs(const std::vector<PathPair>& pairs, double min_s, double max_s,
                                   std::size_t max_samples) {
  std::size_t num = 0;
  for (const PathPair& pair : pairs)
    for (std::size_t k = 0; k < pair.a.size(); ++k) num += may_be_seen(pair, pair.a.time_s(k), min_s, max_s) ? 1 : 0;
  const std::size_t stride = std::max<std::size_t>(1, num / max_samples);
  std::vector<PathRun> runs;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const TimedTrack& a = pairs[p].a;
    for (std::size_t k = 0; k < a.size(); k += stride) {
      if (!may_be_seen(pairs[p], a.time_s(k), min_s, max_s)) continue;
      const bool next = runs.empty() || runs.back().pair != p || a.time_s(k) - runs.back().times_a_s.front() > kRunS;
      if (next) runs.push_back({p, {}, {}});
      runs.back().times_a_s.push_back(a.time_s(k));
      runs.back().a.push_back(a.px(k));
    }
  }
  std::erase_if(runs, [](const PathRun& run) { return run.a.size() < kMinRunSamples; });
  return runs;
}

std::optional<JointFit> fit_jointly(const std::vector<PathPair>& pairs, const std::vector<PointMatch>& still,
                                    const Eigen::Matrix3d& start_F, double start_offset_s, double start_rate,
                                    const JointOptions& options) {
  const std::vector<PathRun> all =
      cut_into_runs(pairs, start_offset_s - kReachS, start_offset_s + kReachS, kMaxSamples);
  std::optional<JointState> state = start_state(all, pairs, start_F, start_offset_s, start_rate, options);
  if (!state) return std::nullopt;
  for (const double width_px : kWidthsPx) {
    const auto runs = runs_within(all, pairs, *state, kGate * width_px);
    if (runs.empty()) return std::nullopt;
    improve(*state, {runs, pairs, still, {width_px, width_px}, options});
  }
  std::vector<PathRun> runs = runs_within(all, pairs, *state, kGate * kWidthsPx[2]);
  if (runs.empty()) return std::nullopt;
  RunNoise noise = estimate_noise(runs, pairs, *state);
  for (int round = 0; round < 2; ++round) {
    improve(*state, {runs, pairs, still, noise, options});
    runs = runs_within(all, pairs, *state, kGate * kWidthsPx[2]);
    if (runs.empty()) return std::nullopt;
    noise = estimate_noise(runs, pairs, *state);
  }
  const auto information = clock_information(*state, {runs, pairs, still, noise, options});
  if (!information) return std::nullopt;
  return summarise(*state, noise, *information, options.estimate_rate);
}

}  // namespace vantage::sync
