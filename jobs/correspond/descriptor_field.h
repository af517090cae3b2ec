#pragma once
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>

namespace vantage {

/// What a picture looks like around each pixel, in the manner of SIFT and DAISY (Lowe 2004; Tola et al. 2010): blurred
/// gradients in eight directions, divided by how strong gradients are around, sampled at 4 x 4 places. Gain and offset
/// of the picture do not matter. Only the eight bytes a pixel are kept; a descriptor is put together when asked for.
class DescriptorField {
 public:
  static constexpr int kDirections = 8, kPlaces = 16, kBytes = kDirections * kPlaces;
  using Descriptor = std::array<std::uint8_t, kBytes>;

  explicit DescriptorField(const cv::Mat1f& grey);
  int width() const { return width_; }
  int height() const { return height_; }
  /// (x, y): inside the picture; places outside repeat its border.
  Descriptor at(int x, int y) const;
  /// Sum of absolute differences, 0 to 255 * kBytes.
  int distance(const Descriptor& descriptor, int x, int y) const;

 private:
  int width_, height_;
  cv::Mat bytes_;  ///< eight directions (channels of 8 bits) a pixel, with a margin
};

}  // namespace vantage
