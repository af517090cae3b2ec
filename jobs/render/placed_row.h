#pragma once
#include <vector>

namespace vantage {

/// Where one row of an image's pixels lies in a view.
struct PlacedRow {
  std::vector<float> x, y;        ///< px, centres at +0.5
  std::vector<float> z;           ///< depth in the view; ≤ 0: behind it
  std::vector<float> order;       ///< what is in front: the depth as far as it counts
  std::vector<float> confidence;  ///< 0–1
  explicit PlacedRow(int width = 0)
      : x(static_cast<std::size_t>(width)), y(x.size()), z(x.size()), order(x.size()), confidence(x.size()) {}
};

}  // namespace vantage
