#pragma once
/// What is known of how long a kind of job takes: log-normal, since durations are products of causes and never
/// negative.
#include <random>
#include <span>

namespace vantage {

/// Of the logarithms of durations in seconds.
struct DurationStats {
  int num = 0;
  double mean_log = 0;
  double var_log = 0;  ///< with num - 1 below the line; 0 for fewer than two
};
DurationStats duration_stats(std::span<const double> durations_s);

/// One possible world: what the true distribution of a kind may be.
struct DurationLaw {
  double mean_log = 0, sd_log = 0;
  double mean_s() const;
  double draw_s(std::mt19937_64& random) const;
  /// Of a job that has run for elapsed_s already: what is left.
  double draw_rest_s(double elapsed_s, std::mt19937_64& random) const;
  /// Of num jobs one after the other.
  double draw_sum_s(int num, std::mt19937_64& random) const;
};

/// The middle of all possible worlds. stats.num > 0.
DurationLaw expected_law(const DurationStats& stats);
/// A world drawn from all that agree with the durations seen: few of them leave many worlds (normal-inverse-chi-squared
/// posterior, Gelman et al., Bayesian Data Analysis 2013, §3.3, with a weak prior on the spread). other_shots: they
/// were seen in other shots, so that the mean may be off by more.
DurationLaw draw_law(const DurationStats& stats, bool other_shots, std::mt19937_64& random);

}  // namespace vantage
