#include "jobs/sync/free_pair.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "jobs/sync/joint_problem.h"
#include "jobs/sync/pair_geometry.h"

namespace vantage::sync {
namespace {

constexpr double kMinRateOverlapS = 20;
/// A rate is believed when it moves neither end of the overlap by more than this share of a frame (1 σ).
constexpr double kMaxRateStdFrames = 0.2;
/// … or when it is not 1 by so many standard deviations.
constexpr double kMinRateStds = 4;
/// One in a thousand: the same level as for the offset itself.
constexpr double kMinLead = 3;
constexpr std::size_t kMaxSamples = 4000;
constexpr std::size_t kMinRunSamples = 3;
/// A run whose residuals are this many standard deviations is explained by nothing.
constexpr double kUnexplained = 3;
constexpr double kMinCommonRuns = 4;

/// Cauchy's log likelihood of a run's mean squared whitened residual, up to sign and constants.
double cost_of(double mean_chi2) {
  return kRunLossScale * kRunLossScale * std::log1p(mean_chi2 / (kRunLossScale * kRunLossScale));
}

/// What each run says against a fit; empty where b does not see it.
using RunCosts = std::vector<std::optional<double>>;

RunCosts run_costs(const std::vector<PathRun>& runs, const std::vector<PathPair>& pairs, const JointFit& fit,
                   double std_px) {
  RunCosts costs;
  for (const PathRun& run : runs) {
    double sum = 0;
    std::size_t num = 0;
    for (std::size_t k = 0; k < run.a.size(); ++k) {
      const auto b = pairs[run.pair].b.at((run.times_a_s[k] - fit.clock.offset_s) / fit.clock.rate);
      if (!b) continue;
      sum += std::pow(sampson_px(fit.F, run.a[k], *b) / std_px, 2);
      ++num;
    }
    costs.push_back(num < kMinRunSamples ? std::nullopt : std::optional(cost_of(sum / static_cast<double>(num))));
  }
  return costs;
}

double explained(const RunCosts& costs) {
  const double most = cost_of(kUnexplained * kUnexplained);
  double sum = 0;
  for (const auto& cost : costs) sum += cost ? most - std::min(*cost, most) : 0;
  return sum;
}

/// Vuong 1989: mean over its standard error of how much worse each run finds the other fit. Runs that only one of the
/// two sees cannot compare them; with too few others the statistic is 0.
double lead_over(const RunCosts& best, const RunCosts& other) {
  double sum = 0, sum2 = 0, num = 0;
  for (std::size_t k = 0; k < best.size(); ++k) {
    if (!best[k] || !other[k]) continue;
    const double d = *other[k] - *best[k];
    sum += d;
    sum2 += d * d;
    ++num;
  }
  return num < kMinCommonRuns || sum2 <= 0 ? 0 : sum / std::sqrt(sum2);
}

double mid_offset_s(const JointFit& fit, double time_b_s) { return fit.clock.offset_s + fit.clock.rate * time_b_s; }

std::optional<JointFit> fit_mode(const FreePairInput& in, const FreeMode& mode) {
  JointOptions options{.lens_a = in.lens_a, .lens_b = in.lens_b, .width_a_px = in.width_a_px};
  auto fit = fit_jointly(in.pairs, in.still, mode.F, mode.offset_s, 1, options);
  if (!fit) {  // eight points may fix F and be far from any E: lenses are then no help
    options.lens_a = options.lens_b = std::nullopt;
    fit = fit_jointly(in.pairs, in.still, mode.F, mode.offset_s, 1, options);
  }
  const double overlap_s = in.range.overlap_s(fit ? fit->clock.offset_s : mode.offset_s);
  if (overlap_s < kMinRateOverlapS) return fit;
  options.estimate_rate = true;
  const auto with_rate =
      fit_jointly(in.pairs, in.still, fit ? fit->F : mode.F, fit ? fit->clock.offset_s : mode.offset_s, 1, options);
  if (!with_rate) return fit;
  const bool well_determined = 0.5 * overlap_s * with_rate->clock.rate_std < kMaxRateStdFrames * in.frame_s;
  const bool not_one = std::abs(with_rate->clock.rate - 1) > kMinRateStds * with_rate->clock.rate_std;
  return well_determined || not_one ? with_rate : fit;
}

}  // namespace

FreePairAnswer solve_free_pair(const FreePairInput& in) {
  FreePairAnswer answer{.scan = scan_free(in.pairs, in.still, in.range), .fit = {}};
  std::vector<JointFit> fits;
  for (const FreeMode& mode : answer.scan.modes)
    if (auto fit = fit_mode(in, mode)) fits.push_back(std::move(*fit));
  if (fits.empty()) return answer;

  // All are judged by the noise of the one that fits best.
  double std_px = std::numeric_limits<double>::infinity();
  for (const JointFit& fit : fits) std_px = std::min(std_px, std::hypot(fit.clock.noise_px, fit.clock.bias_px));
  double first_s = fits.front().clock.offset_s, last_s = first_s;
  for (const JointFit& fit : fits) {
    first_s = std::min(first_s, fit.clock.offset_s);
    last_s = std::max(last_s, fit.clock.offset_s);
  }
  const std::vector<PathRun> runs = cut_into_runs(in.pairs, first_s, last_s, kMaxSamples);
  std::vector<RunCosts> costs;
  for (const JointFit& fit : fits) costs.push_back(run_costs(runs, in.pairs, fit, std_px));
  std::size_t best = 0;
  for (std::size_t k = 1; k < fits.size(); ++k)
    if (explained(costs[k]) > explained(costs[best])) best = k;

  answer.fit = fits[best];
  answer.lead = std::numeric_limits<double>::infinity();
  const double middle_s = fits[best].clock.pivot_b_s, at_s = mid_offset_s(fits[best], middle_s);
  for (std::size_t k = 0; k < fits.size(); ++k) {
    const double apart_s = std::abs(mid_offset_s(fits[k], middle_s) - at_s);
    if (apart_s < std::max(0.5 * in.frame_s, 4 * fits[best].clock.std_s)) continue;  // the same answer
    const double lead = lead_over(costs[best], costs[k]);
    if (lead < answer.lead) answer.lead = lead, answer.rival_offset_s = fits[k].clock.offset_s;
  }
  return answer;
}

void judge_free_pair(PairOffset& offset, const FreePairAnswer& answer, const VerdictLimits& limits) {
  if (!answer.fit) return undetermined(offset, "no offset and pose of the cameras explain what both see");
  const OffsetFit& clock = answer.fit->clock;
  offset.offset_s = clock.offset_s;
  offset.rate = clock.rate;
  offset.rate_std = clock.rate_std;
  offset.std_s = clock.std_s;
  offset.pivot_b_s = clock.pivot_b_s;
  offset.num_inliers = clock.num_tracks;
  const double std_frames = clock.std_s / limits.frame_s;
  if (!(std_frames <= limits.max_std_frames))
    return undetermined(offset, fmt::format("with the cameras' poses unknown the motion does not tell time (± {:.2f} "
                                            "frame, at most {:.2f} is useful)",
                                            std_frames, limits.max_std_frames));
  if (clock.effective_tracks < limits.min_tracks)
    return undetermined(offset, fmt::format("rests on {:.1f} runs of tracks, at least {} are needed",
                                            clock.effective_tracks, limits.min_tracks));
  if (answer.lead < kMinLead)
    return undetermined(offset,
                        fmt::format("{:+.3f} s fits nearly as well as {:+.3f} s (lead {:.1f} σ, expected {:.0f})",
                                    answer.rival_offset_s, clock.offset_s, answer.lead, kMinLead));
  offset.determined = true;
  offset.verdict =
      fmt::format("{:+.4f} s ± {:.1f} ms ({:.3f} frame) from {} runs of tracks, the cameras' poses unknown",
                  clock.offset_s, 1e3 * clock.std_s, std_frames, clock.num_tracks);
}

}  // namespace vantage::sync
