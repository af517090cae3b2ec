#include "jobs/views/monotone_cubic.h"

#include <algorithm>
#include <functional>

#include "schema/base/error.h"

namespace vantage {

MonotoneCubic::MonotoneCubic(std::vector<double> xs, std::vector<double> ys) : xs_(std::move(xs)), ys_(std::move(ys)) {
  check(!xs_.empty() && xs_.size() == ys_.size(), "a curve has points, each with a value");
  check(std::adjacent_find(xs_.begin(), xs_.end(), std::greater_equal<>()) == xs_.end(), "a curve's points rise");
}

double MonotoneCubic::secant(std::size_t k) const { return (ys_[k + 1] - ys_[k]) / (xs_[k + 1] - xs_[k]); }

/// At point k: the weighted harmonic mean of its neighbours' secants, 0 at a turn.
double MonotoneCubic::slope(std::size_t k) const {
  if (k == 0) return secant(0);
  if (k + 1 == xs_.size()) return secant(k - 1);
  const double before = secant(k - 1), after = secant(k);
  if (before * after <= 0) return 0;
  const double h0 = xs_[k] - xs_[k - 1], h1 = xs_[k + 1] - xs_[k];
  const double w0 = 2 * h1 + h0, w1 = h1 + 2 * h0;
  return (w0 + w1) / (w0 / before + w1 / after);
}

double MonotoneCubic::operator()(double x) const {
  if (x <= xs_.front()) return ys_.front();
  if (x >= xs_.back()) return ys_.back();
  const auto k = static_cast<std::size_t>(std::upper_bound(xs_.begin(), xs_.end(), x) - xs_.begin()) - 1;
  const double a = ys_[k], b = ys_[k + 1];
  if (a == b) return a;
  const double h = xs_[k + 1] - xs_[k], s = (x - xs_[k]) / h;
  const double s2 = s * s, s3 = s2 * s;
  return a * (2 * s3 - 3 * s2 + 1) + b * (3 * s2 - 2 * s3) +
         h * (slope(k) * (s3 - 2 * s2 + s) + slope(k + 1) * (s3 - s2));
}

}  // namespace vantage
