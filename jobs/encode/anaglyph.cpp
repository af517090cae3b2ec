#include "jobs/encode/film.h"
#include "jobs/vision/colour_space.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// Rows R, G, B out; columns R, G, B of the left eye, then of the right; linear light.
constexpr float kDubois[3][6] = {{0.456F, 0.500F, 0.176F, -0.043F, -0.088F, -0.002F},
                                 {-0.040F, -0.038F, -0.016F, 0.378F, 0.734F, -0.018F},
                                 {-0.015F, -0.021F, -0.005F, -0.072F, -0.113F, 1.226F}};

}  // namespace

cv::Mat3b anaglyph(const cv::Mat3b& left, const cv::Mat3b& right) {
  check(left.size() == right.size(), "both eyes have one size");
  const cv::Mat3f l = linear_from_srgb(left), r = linear_from_srgb(right);
  cv::Mat3f out(left.size());
  for (int y = 0; y < out.rows; ++y)
    for (int x = 0; x < out.cols; ++x) {
      const float in[6] = {l(y, x)[2], l(y, x)[1], l(y, x)[0], r(y, x)[2], r(y, x)[1], r(y, x)[0]};
      for (int row = 0; row < 3; ++row) {
        float sum = 0;
        for (int k = 0; k < 6; ++k) sum += kDubois[row][k] * in[k];
        out(y, x)[2 - row] = sum;
      }
    }
  return srgb8_from_linear(out);
}

}  // namespace vantage
