#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

namespace vantage {

/// The upper one of two middle values. At least one value.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Standard deviation of normal deviations from 0, by the median of their absolute values; fallback when there is none.
inline double robust_std(std::vector<double> deviations, double fallback) {
  if (deviations.empty()) return fallback;
  for (double& d : deviations) d = std::abs(d);
  return 1.4826 * median(std::move(deviations));
}

}  // namespace vantage
