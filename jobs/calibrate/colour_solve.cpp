#include "jobs/calibrate/colour_solve.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>

namespace vantage {
namespace {

constexpr int kPerCamera = 4;  // gamma - 1, log gain of red, green, blue
constexpr int kRounds = 20;
constexpr double kHuber = 1.345;  // 95 % efficient for normal errors (Huber 1981)
/// How strongly the sums of all gammas - 1 and of all logarithms of a channel's gains are held at 0: without it all
/// gammas 0 would make every error 0.
constexpr double kGaugeStd = 1e-6;
/// A camera without samples stays as it is; next to samples this is nothing.
constexpr double kPriorStd = 2;
/// Differences that matter: 2 % of linear light is 1 % of a level, too little to see; a gamma of 1.05 does that two
/// stops from mid grey. Smaller ones are what reflections and the samples' misalignment leave (0.8 % and 0.02 on
/// rendered cameras that are exactly alike).
constexpr double kSmallestLogGain = 0.02, kSmallestGamma = 0.05, kSigmas = 3;

/// One channel of a sample: the difference to be made 0, and how well it is known.
struct Equation {
  int gamma_a, gamma_b, gain_a, gain_b;  // places among the unknowns
  double log_a, log_b, weight;
  double error(const Eigen::VectorXd& x) const {
    return (1 + x[gamma_a]) * log_a + x[gain_a] - (1 + x[gamma_b]) * log_b - x[gain_b];
  }
};

/// d log L / d level falls with the level: sRGB is about a power law there.
double knowledge(double linear_a, double linear_b) {
  const double a = level_of_linear(linear_a) / 128, b = level_of_linear(linear_b) / 128;
  return 2 / (1 / (a * a) + 1 / (b * b));
}

std::vector<Equation> equations_of(const std::vector<ColourSample>& samples) {
  std::vector<Equation> out;
  for (const auto& s : samples)
    for (int k = 0; k < 3; ++k)
      out.push_back({kPerCamera * s.camera_a, kPerCamera * s.camera_b, kPerCamera * s.camera_a + 1 + k,
                     kPerCamera * s.camera_b + 1 + k, std::log(s.linear_a[k] / kMidGrey),
                     std::log(s.linear_b[k] / kMidGrey), knowledge(s.linear_a[k], s.linear_b[k])});
  return out;
}

std::vector<int> count_samples(const std::vector<ColourSample>& samples, int num_cameras) {
  std::vector<int> num(static_cast<std::size_t>(num_cameras), 0);
  for (const auto& s : samples)
    for (const int camera : {s.camera_a, s.camera_b}) ++num[static_cast<std::size_t>(camera)];
  return num;
}

/// Which of the cameras hang together most, by samples between them.
std::vector<bool> largest_group(const std::vector<ColourSample>& samples, int num_cameras) {
  std::vector<int> group(static_cast<std::size_t>(num_cameras));
  std::iota(group.begin(), group.end(), 0);
  for (const auto& s : samples)
    std::ranges::replace(group, int{group[static_cast<std::size_t>(s.camera_b)]},
                         int{group[static_cast<std::size_t>(s.camera_a)]});
  const int largest = *std::ranges::max_element(group, {}, [&](int g) { return std::ranges::count(group, g); });
  std::vector<bool> is_in;
  for (const int g : group) is_in.push_back(g == largest);
  return is_in;
}

/// Samples between cameras that have kFewSamples of such samples and hang together; of others nothing says enough.
std::vector<ColourSample> trusted_samples(std::vector<ColourSample> samples, int num_cameras) {
  const auto drop_unless = [&](auto&& is_good) {
    return std::erase_if(samples, [&](const auto& s) { return !is_good(s.camera_a) || !is_good(s.camera_b); });
  };
  const auto has_enough = [](const std::vector<int>& num) {
    return [&num](int camera) { return num[static_cast<std::size_t>(camera)] >= kFewSamples; };
  };
  for (auto num = count_samples(samples, num_cameras); drop_unless(has_enough(num)) > 0;)
    num = count_samples(samples, num_cameras);
  const auto is_in = largest_group(samples, num_cameras);
  drop_unless([&](int camera) { return is_in[static_cast<std::size_t>(camera)]; });
  return samples;
}

/// 1.4826 times the median of the weighted errors' sizes.
double robust_std(const std::vector<Equation>& equations, const Eigen::VectorXd& x) {
  std::vector<double> sizes;
  for (const auto& e : equations) sizes.push_back(std::sqrt(e.weight) * std::abs(e.error(x)));
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return std::max(1e-6, 1.4826 * *middle);
}

struct Fit {
  Eigen::VectorXd x;
  Eigen::MatrixXd covariance;
  double residual = 0;
};

/// What holds the solution where samples do not. compared: the cameras that have samples.
Eigen::MatrixXd prior_information(const std::vector<int>& compared, Eigen::Index num_unknowns, bool hold_gammas) {
  constexpr double kFixed = 1 / (kGaugeStd * kGaugeStd);
  Eigen::MatrixXd prior = Eigen::MatrixXd::Zero(num_unknowns, num_unknowns);
  prior.diagonal().setConstant(1 / (kPriorStd * kPriorStd));
  for (const int a : compared)
    for (const int b : compared)
      for (int k = 0; k < kPerCamera; ++k) prior(kPerCamera * a + k, kPerCamera * b + k) += kFixed;
  if (hold_gammas)
    for (Eigen::Index i = 0; i < num_unknowns; i += kPerCamera) prior(i, i) += kFixed;
  return prior;
}

/// Adds the samples' part of the normal equations, Huber's weights at x.
void add_information(const std::vector<Equation>& equations, const Eigen::VectorXd& x, double sigma,
                     Eigen::MatrixXd& normal, Eigen::VectorXd& right_side) {
  for (const auto& e : equations) {
    const double size = std::sqrt(e.weight) * std::abs(e.error(x)) / sigma;
    const double w = e.weight * std::min(1.0, kHuber / std::max(size, 1e-12)) / (sigma * sigma);
    const std::array<int, 4> at{e.gamma_a, e.gamma_b, e.gain_a, e.gain_b};
    const std::array<double, 4> slope{e.log_a, -e.log_b, 1, -1};
    for (std::size_t i = 0; i < 4; ++i) {
      right_side[at[i]] -= w * slope[i] * (e.log_a - e.log_b);
      for (std::size_t j = 0; j < 4; ++j) normal(at[i], at[j]) += w * slope[i] * slope[j];
    }
  }
}

Fit fit(const std::vector<Equation>& equations, const std::vector<int>& compared, int num_cameras, bool hold_gammas) {
  const Eigen::Index num = kPerCamera * num_cameras;
  const Eigen::MatrixXd prior = prior_information(compared, num, hold_gammas);
  Fit out{.x = Eigen::VectorXd::Zero(num), .covariance = {}, .residual = 0};
  Eigen::MatrixXd normal;
  for (int round = 0; round < kRounds; ++round) {
    out.residual = robust_std(equations, out.x);
    normal = prior;
    Eigen::VectorXd right_side = Eigen::VectorXd::Zero(num);
    add_information(equations, out.x, out.residual, normal, right_side);
    out.x = normal.ldlt().solve(right_side);
  }
  out.covariance = normal.ldlt().solve(Eigen::MatrixXd::Identity(num, num));
  return out;
}

void take(const Fit& fit, ColourSolution& out) {
  const auto std_of = [&](Eigen::Index i) { return std::sqrt(std::max(0.0, fit.covariance(i, i))); };
  out.residual = fit.residual;
  for (std::size_t c = 0; c < out.colours.size(); ++c) {
    const auto at = static_cast<Eigen::Index>(kPerCamera * c);
    out.colours[c].gamma = 1 + fit.x[at];
    out.gamma_std[c] = std_of(at);
    out.gain_std[c] = std::max({std_of(at + 1), std_of(at + 2), std_of(at + 3)});
    for (std::size_t k = 0; k < 3; ++k) out.colours[c].gain[k] = std::exp(fit.x[at + 1 + static_cast<Eigen::Index>(k)]);
  }
}

bool matters(double value, double smallest, double std) {
  return std::abs(value) > smallest && std::abs(value) > kSigmas * std;
}

bool some_gamma_matters(const ColourSolution& solution) {
  for (std::size_t c = 0; c < solution.colours.size(); ++c)
    if (matters(solution.colours[c].gamma - 1, kSmallestGamma, solution.gamma_std[c])) return true;
  return false;
}

}  // namespace

ColourSolution solve_colours(const std::vector<ColourSample>& samples, int num_cameras) {
  const auto trusted = trusted_samples(samples, num_cameras);
  const auto num = static_cast<std::size_t>(num_cameras);
  ColourSolution out{.colours = std::vector<CameraColour>(num),
                     .gain_std = std::vector<double>(num, kPriorStd),
                     .gamma_std = std::vector<double>(num, kPriorStd),
                     .num_samples = count_samples(trusted, num_cameras),
                     .residual = 0};
  if (trusted.empty()) return out;
  std::vector<int> compared;
  for (int camera = 0; camera < num_cameras; ++camera)
    if (out.is_compared(static_cast<std::size_t>(camera))) compared.push_back(camera);
  const auto equations = equations_of(trusted);
  take(fit(equations, compared, num_cameras, false), out);
  if (!some_gamma_matters(out)) take(fit(equations, compared, num_cameras, true), out);
  return out;
}

bool ColourSolution::is_significant() const {
  if (some_gamma_matters(*this)) return true;
  for (std::size_t c = 0; c < colours.size(); ++c)
    for (const double gain : colours[c].gain)
      if (matters(std::log(gain), kSmallestLogGain, gain_std[c])) return true;
  return false;
}

}  // namespace vantage
