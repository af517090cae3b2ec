#pragma once
#include <array>
#include <cstdint>

namespace vantage {

/// How many values lay at or below each bound: what Prometheus calls a histogram.
template <std::size_t N>
struct Histogram {
  std::array<std::int64_t, N> num_up_to{};  ///< cumulative
  std::int64_t num = 0;
  double sum = 0;
  void add(const std::array<double, N>& bounds, double value) {
    for (std::size_t i = 0; i < N; ++i)
      if (value <= bounds[i]) ++num_up_to[i];
    ++num;
    sum += value;
  }
};

}  // namespace vantage
