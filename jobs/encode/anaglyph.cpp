#include <algorithm>

#include "jobs/encode/layout.h"
#include "jobs/vision/colour_space.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// Rows R, G, B out; columns R, G, B of the left eye, then of the right; linear light.
constexpr float kDubois[3][6] = {{0.456F, 0.500F, 0.176F, -0.043F, -0.088F, -0.002F},
                                 {-0.040F, -0.038F, -0.016F, 0.378F, 0.734F, -0.018F},
                                 {-0.015F, -0.021F, -0.005F, -0.072F, -0.113F, 1.226F}};

}  // namespace

cv::Mat anaglyph(const cv::Mat& left, const cv::Mat& right) {
  check(left.size() == right.size() && left.type() == right.type(), "both eyes have one size");
  const cv::Mat3f l = linear_from_srgb(left), r = linear_from_srgb(right);
  cv::Mat3f out(l.size());
  for (int y = 0; y < out.rows; ++y)
    for (int x = 0; x < out.cols; ++x) {
      const cv::Vec3f &a = l(y, x), &b = r(y, x);
      const float in[6] = {a[2], a[1], a[0], b[2], b[1], b[0]};
      for (int row = 0; row < 3; ++row) {
        float sum = 0;
        for (int k = 0; k < 6; ++k) sum += kDubois[row][k] * in[k];
        out(y, x)[2 - row] = std::clamp(sum, 0.0F, 1.0F);
      }
    }
  if (left.depth() == CV_16U) return srgb16_from_linear(out);
  return srgb8_from_linear(out);
}

}  // namespace vantage
