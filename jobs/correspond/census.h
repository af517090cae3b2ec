#pragma once
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace vantage {

/// Census transform over 9 x 7 pixels (Zabih & Woodfill 1994): bit k says whether neighbour k is darker than the
/// centre, so gain and offset between cameras do not matter. One word of 62 bits a pixel, row by row.
struct Census {
  int width = 0, height = 0;
  std::vector<std::uint64_t> bits;
  const std::uint64_t* row(int y) const {
    return bits.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
  }
};
constexpr int kCensusBits = 62;

/// grey: 8 bit. Neighbours outside the picture repeat its border.
Census census_transform(const cv::Mat1b& grey);

/// Bits that differ, per pixel, 0 to 62.
cv::Mat1f census_distance(const Census& a, const Census& b);

}  // namespace vantage
