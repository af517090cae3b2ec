#include "jobs/views/disparity_histogram.h"

#include <algorithm>
#include <cmath>

#include "schema/base/error.h"

namespace vantage {
namespace {
constexpr int kNumCells = 2000;
}

DisparityHistogram::DisparityHistogram(double width_px) : width_px_(width_px), weights_(kNumCells, 0.0) {
  check(width_px > 0, "a picture has a width");
}

void DisparityHistogram::add(double disparity_px, double weight) {
  const double cell = std::clamp((disparity_px / width_px_ + 0.5) * kNumCells, 0.0, kNumCells - 1.0);
  weights_[static_cast<std::size_t>(cell)] += weight;
  total_ += weight;
}

double DisparityHistogram::share_below(double disparity_px) const {
  check(!empty(), "a share is of something");
  const double cell = std::clamp((disparity_px / width_px_ + 0.5) * kNumCells, 0.0, 1.0 * kNumCells);
  double sum = 0;
  for (int k = 0; k < kNumCells; ++k) sum += weights_[static_cast<std::size_t>(k)] * std::clamp(cell - k, 0.0, 1.0);
  return sum / total_;
}

double DisparityHistogram::quantile(double share) const {
  check(!empty(), "a quantile is of something");
  const double wanted = share * total_;
  double below = 0;
  for (int k = 0; k < kNumCells; ++k) {
    const double weight = weights_[static_cast<std::size_t>(k)];
    if (weight > 0 && below + weight >= wanted)
      return (std::clamp((wanted - below) / weight, 0.0, 1.0) + k - 0.5 * kNumCells) * width_px_ / kNumCells;
    below += weight;
  }
  return 0.5 * width_px_;
}

}  // namespace vantage
