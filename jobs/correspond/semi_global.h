#pragma once
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace vantage {

/// Cost of every label at every pixel; labels of a pixel lie side by side.
class CostVolume {
 public:
  CostVolume(cv::Size size, int labels)
      : width(size.width),
        height(size.height),
        num_labels(labels),
        costs_(static_cast<std::size_t>(size.area()) * static_cast<std::size_t>(labels)) {}
  std::uint8_t* at(int x, int y) { return costs_.data() + offset(x, y); }
  const std::uint8_t* at(int x, int y) const { return costs_.data() + offset(x, y); }
  std::size_t offset(int x, int y) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
           static_cast<std::size_t>(num_labels);
  }
  std::size_t size() const { return costs_.size(); }

  const int width, height, num_labels;

 private:
  std::vector<std::uint8_t> costs_;
};

/// Label of least cost plus penalties for jumps, summed over 8 paths (Hirschmüller 2008, §2.2–2.3). A jump is cheaper
/// where `guide` has an edge. Between labels by a parabola. Costs at most 62, as census gives them.
cv::Mat1f semi_global_labels(const CostVolume& volume, const cv::Mat1b& guide);

}  // namespace vantage
