#pragma once
#include <cstddef>
#include <vector>

namespace vantage {

/// How much of a picture has which disparity. Cells of 1/2000 of the picture's width over ± half of it; what lies
/// beyond counts in the outermost.
class DisparityHistogram {
 public:
  DisparityHistogram() = default;  ///< of nothing
  explicit DisparityHistogram(double width_px);
  void add(double disparity_px, double weight);
  bool empty() const { return !(total_ > 0); }
  /// Share of the weight below this disparity, 0–1, continuous.
  double share_below(double disparity_px) const;
  /// Disparity that this share (0–1) of the weight lies below. The histogram must not be empty.
  double quantile(double share) const;

 private:
  double width_px_ = 0, total_ = 0;
  std::vector<double> weights_;
};

}  // namespace vantage
