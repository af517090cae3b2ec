#pragma once
#include <array>
#include <cmath>
#include <cstddef>
#include <opencv2/core.hpp>

namespace vantage {

/// exp(-d² / 2σ²) of the distance d of two 8-bit colours, σ per channel; from a table.
class ColourWeight {
 public:
  explicit ColourWeight(double sigma) {
    for (std::size_t k = 0; k < table_.size(); ++k)
      table_[k] = static_cast<float>(std::exp(-static_cast<double>(k << kShift) / (2 * 3 * sigma * sigma)));
  }
  float operator()(const cv::Vec3b& a, const cv::Vec3b& b) const {
    const int d0 = a[0] - b[0], d1 = a[1] - b[1], d2 = a[2] - b[2];
    return table_[static_cast<std::size_t>((d0 * d0 + d1 * d1 + d2 * d2) >> kShift)];
  }

 private:
  static constexpr int kShift = 6;
  std::array<float, (3 * 255 * 255 >> kShift) + 1> table_{};
};

}  // namespace vantage
