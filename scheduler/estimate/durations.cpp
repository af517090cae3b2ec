#include "scheduler/estimate/durations.h"

#include <algorithm>
#include <cmath>

namespace vantage {
namespace {

// Jobs of one kind in one shot mostly differ by a third; the prior weighs as much as two of them.
constexpr double kPriorSdLog = 0.35, kPriorNum = 2;
// Footage of another shot may be half or double the size.
constexpr double kOtherShotSdLog = 0.5;
constexpr double kShortest_s = 1e-3;

double posterior_var(const DurationStats& s) {
  const double num = std::max(0, s.num - 1);
  return (kPriorNum * kPriorSdLog * kPriorSdLog + num * s.var_log) / (kPriorNum + num);
}

}  // namespace

DurationStats duration_stats(std::span<const double> durations_s) {
  DurationStats stats{.num = static_cast<int>(durations_s.size())};
  if (stats.num == 0) return stats;
  for (const double d : durations_s) stats.mean_log += std::log(std::max(d, kShortest_s)) / stats.num;
  if (stats.num < 2) return stats;
  for (const double d : durations_s) {
    const double off = std::log(std::max(d, kShortest_s)) - stats.mean_log;
    stats.var_log += off * off / (stats.num - 1);
  }
  return stats;
}

double DurationLaw::mean_s() const { return std::exp(mean_log + 0.5 * sd_log * sd_log); }

double DurationLaw::draw_s(std::mt19937_64& random) const {
  return std::exp(mean_log + sd_log * std::normal_distribution<double>()(random));
}

double DurationLaw::draw_rest_s(double elapsed_s, std::mt19937_64& random) const {
  constexpr int kMaxTries = 20;
  for (int i = 0; i < kMaxTries; ++i)
    if (const double all = draw_s(random); all > elapsed_s) return all - elapsed_s;
  return 0.3 * elapsed_s;  // longer than any seen: such jobs rarely end at once
}

double DurationLaw::draw_sum_s(int num, std::mt19937_64& random) const {
  constexpr int kMaxSingle = 8;
  if (num <= kMaxSingle) {
    double sum = 0;
    for (int i = 0; i < num; ++i) sum += draw_s(random);
    return sum;
  }
  const double mean = mean_s(), sd = mean * std::sqrt(std::expm1(sd_log * sd_log));
  const double sum = num * mean + std::sqrt(num) * sd * std::normal_distribution<double>()(random);
  return std::max(sum, 0.1 * num * mean);
}

DurationLaw expected_law(const DurationStats& stats) {
  return {.mean_log = stats.mean_log, .sd_log = std::sqrt(posterior_var(stats))};
}

DurationLaw draw_law(const DurationStats& stats, bool other_shots, std::mt19937_64& random) {
  const double freedom = kPriorNum + std::max(0, stats.num - 1);
  const double chi = std::chi_squared_distribution<double>(freedom)(random);
  const double widest = 3 * std::sqrt(posterior_var(stats));
  const double sd = std::min(widest, std::sqrt(posterior_var(stats) * freedom / std::max(chi, 1e-6)));
  std::normal_distribution<double> normal;
  double mean = stats.mean_log + sd / std::sqrt(stats.num) * normal(random);
  if (other_shots) mean += kOtherShotSdLog * normal(random);
  return {.mean_log = mean, .sd_log = sd};
}

}  // namespace vantage
