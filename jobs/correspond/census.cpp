#include "jobs/correspond/census.h"

#include <bit>

#include "jobs/vision/vector_clones.h"

namespace vantage {
namespace {

constexpr int kRadiusX = 4, kRadiusY = 3;

/// Appends one bit per pixel: neighbour darker than centre.
VANTAGE_VECTOR_CLONES void push_bit(const uchar* centre, const uchar* neighbour, std::uint64_t* bits, int width) {
  for (int x = 0; x < width; ++x) bits[x] = (bits[x] << 1) | static_cast<std::uint64_t>(neighbour[x] < centre[x]);
}

VANTAGE_VECTOR_CLONES void hamming_row(const std::uint64_t* a, const std::uint64_t* b, float* out, int width) {
  for (int x = 0; x < width; ++x) out[x] = static_cast<float>(std::popcount(a[x] ^ b[x]));
}

}  // namespace

Census census_transform(const cv::Mat1b& grey) {
  cv::Mat1b padded;
  cv::copyMakeBorder(grey, padded, kRadiusY, kRadiusY, kRadiusX, kRadiusX, cv::BORDER_REPLICATE);
  Census census{grey.cols, grey.rows, std::vector<std::uint64_t>(grey.total(), 0)};
  for (int y = 0; y < grey.rows; ++y) {
    std::uint64_t* bits = census.bits.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(grey.cols);
    const uchar* centre = padded[y + kRadiusY] + kRadiusX;
    for (int dy = -kRadiusY; dy <= kRadiusY; ++dy)
      for (int dx = -kRadiusX; dx <= kRadiusX; ++dx)
        if (dx != 0 || dy != 0) push_bit(centre, padded[y + kRadiusY + dy] + kRadiusX + dx, bits, grey.cols);
  }
  return census;
}

cv::Mat1f census_distance(const Census& a, const Census& b) {
  cv::Mat1f distance(a.height, a.width);
  for (int y = 0; y < a.height; ++y) hamming_row(a.row(y), b.row(y), distance[y], a.width);
  return distance;
}

}  // namespace vantage
