#include <algorithm>
#include <array>
#include <cmath>

#include "jobs/encode/film.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// Rows R, G, B out; columns R, G, B of the left eye, then of the right; linear light.
constexpr float kDubois[3][6] = {{0.456F, 0.500F, 0.176F, -0.043F, -0.088F, -0.002F},
                                 {-0.040F, -0.038F, -0.016F, 0.378F, 0.734F, -0.018F},
                                 {-0.015F, -0.021F, -0.005F, -0.072F, -0.113F, 1.226F}};

std::array<float, 256> linear_table() {
  std::array<float, 256> table{};
  for (std::size_t k = 0; k < table.size(); ++k) {
    const float v = static_cast<float>(k) / 255;
    table[k] = v <= 0.04045F ? v / 12.92F : std::pow((v + 0.055F) / 1.055F, 2.4F);
  }
  return table;
}

uchar srgb_of(float linear) {
  const float v = std::clamp(linear, 0.0F, 1.0F);
  return cv::saturate_cast<uchar>(255 * (v <= 0.0031308F ? 12.92F * v : 1.055F * std::pow(v, 1 / 2.4F) - 0.055F));
}

}  // namespace

cv::Mat3b anaglyph(const cv::Mat3b& left, const cv::Mat3b& right) {
  check(left.size() == right.size(), "both eyes have one size");
  static const std::array<float, 256> linear = linear_table();
  cv::Mat3b out(left.size());
  for (int y = 0; y < out.rows; ++y)
    for (int x = 0; x < out.cols; ++x) {
      const cv::Vec3b l = left(y, x), r = right(y, x);
      const float in[6] = {linear[l[2]], linear[l[1]], linear[l[0]], linear[r[2]], linear[r[1]], linear[r[0]]};
      for (int row = 0; row < 3; ++row) {
        float sum = 0;
        for (int k = 0; k < 6; ++k) sum += kDubois[row][k] * in[k];
        out(y, x)[2 - row] = srgb_of(sum);
      }
    }
  return out;
}

}  // namespace vantage
