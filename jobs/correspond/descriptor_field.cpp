#include "jobs/correspond/descriptor_field.h"

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "jobs/vision/vector_clones.h"

namespace vantage {
namespace {

constexpr std::array<int, 4> kOffsets_px{-5, -2, 1, 4};
constexpr int kMargin_px = 5;
constexpr double kCellSigma_px = 1.6, kAroundSigma_px = 5;
/// Gradients weaker than this (grey levels per px) are the sensor's noise rather than a look.
constexpr float kNoise = 1.0F;
/// Strength of a direction against the mean around that fills the byte.
constexpr float kFullScale = 3.0F;

VANTAGE_VECTOR_CLONES int sum_of_differences(const std::uint8_t* a, const std::uint8_t* b) {
  int sum = 0;
  for (int k = 0; k < DescriptorField::kBytes; ++k) sum += std::abs(a[k] - b[k]);
  return sum;
}

}  // namespace

DescriptorField::DescriptorField(const cv::Mat1f& grey) : width_(grey.cols), height_(grey.rows) {
  cv::Mat1f dx, dy, strength, around;
  cv::Sobel(grey, dx, CV_32F, 1, 0, 3, 1.0 / 8, 0, cv::BORDER_REPLICATE);
  cv::Sobel(grey, dy, CV_32F, 0, 1, 3, 1.0 / 8, 0, cv::BORDER_REPLICATE);
  cv::magnitude(dx, dy, strength);
  cv::GaussianBlur(strength, around, {}, kAroundSigma_px, kAroundSigma_px, cv::BORDER_REPLICATE);
  around += kNoise;
  cv::Mat bytes(grey.size(), CV_8UC(kDirections));
  for (int k = 0; k < kDirections; ++k) {
    const double angle = 2 * std::numbers::pi * k / kDirections;
    cv::Mat along = std::cos(angle) * dx + std::sin(angle) * dy;
    along = cv::max(along, 0.0);
    cv::GaussianBlur(along, along, {}, kCellSigma_px, kCellSigma_px, cv::BORDER_REPLICATE);
    cv::Mat1b scaled;
    cv::divide(along, around, scaled, 255 / kFullScale, CV_8U);
    cv::insertChannel(scaled, bytes, k);
  }
  cv::copyMakeBorder(bytes, bytes_, kMargin_px, kMargin_px, kMargin_px, kMargin_px, cv::BORDER_REPLICATE);
}

DescriptorField::Descriptor DescriptorField::at(int x, int y) const {
  Descriptor out;
  std::uint8_t* place = out.data();
  for (const int dy : kOffsets_px) {
    const std::uint8_t* row = bytes_.ptr(y + dy + kMargin_px) + (x + kMargin_px) * kDirections;
    for (const int dx : kOffsets_px) {
      std::memcpy(place, row + dx * kDirections, kDirections);
      place += kDirections;
    }
  }
  return out;
}

int DescriptorField::distance(const Descriptor& descriptor, int x, int y) const {
  const Descriptor other = at(x, y);
  return sum_of_differences(descriptor.data(), other.data());
}

}  // namespace vantage
