#include "tests/bench/middle_frame.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace vantage {
namespace {

constexpr float kConsistent_px = 1, kWeightOfHidden = 0.02F;

/// A motion field in the frame in the middle and how much of the picture arrived there.
struct Arrived {
  cv::Mat2f motion;
  cv::Mat1f weight;
};

void spread(cv::Point2f to, float weight, cv::Vec2f motion, Arrived& out) {
  const int x0 = cvFloor(to.x), y0 = cvFloor(to.y);
  const float fx = to.x - static_cast<float>(x0), fy = to.y - static_cast<float>(y0);
  for (int k = 0; k < 4; ++k) {
    const int x = x0 + (k & 1), y = y0 + (k >> 1);
    if (x < 0 || y < 0 || x >= out.weight.cols || y >= out.weight.rows) continue;
    const float w = weight * ((k & 1) != 0 ? fx : 1 - fx) * ((k >> 1) != 0 ? fy : 1 - fy);
    out.weight(y, x) += w;
    out.motion(y, x) += w * motion;
  }
}

/// Cracks and holes take the mean motion of what lies around, from ever farther away.
void close_holes(Arrived& field) {
  cv::Mat2f motion = field.motion.clone();
  cv::Mat1f weight = field.weight.clone();
  for (double sigma = 1; sigma < 64; sigma *= 2) {
    cv::Mat2f near_motion;
    cv::Mat1f near_weight;
    cv::GaussianBlur(field.motion, near_motion, {}, sigma);
    cv::GaussianBlur(field.weight, near_weight, {}, sigma);
    for (int y = 0; y < weight.rows; ++y)
      for (int x = 0; x < weight.cols; ++x)
        if (weight(y, x) < 1e-3F && near_weight(y, x) > 1e-4F)
          weight(y, x) = near_weight(y, x), motion(y, x) = near_motion(y, x);
  }
  for (int y = 0; y < weight.rows; ++y)
    for (int x = 0; x < weight.cols; ++x) field.motion(y, x) = motion(y, x) / std::max(1e-6F, weight(y, x));
}

Arrived carried(const cv::Mat2f& motion, const cv::Mat2f& back) {
  Arrived out{cv::Mat2f(motion.size(), cv::Vec2f(0, 0)), cv::Mat1f(motion.size(), 0.0F)};
  const cv::Mat1f loop = round_trip_px(motion, back);
  for (int y = 0; y < motion.rows; ++y)
    for (int x = 0; x < motion.cols; ++x) {
      const cv::Vec2f m = motion(y, x);
      const cv::Point2f to(static_cast<float>(x) + 0.5F * m[0], static_cast<float>(y) + 0.5F * m[1]);
      spread(to, loop(y, x) < kConsistent_px ? 1 : kWeightOfHidden, m, out);
    }
  close_holes(out);
  return out;
}

/// The picture that the field came from, looked up from the middle.
cv::Mat3f looked_up(const cv::Mat& picture, const cv::Mat2f& motion) {
  cv::Mat2f back;
  motion.convertTo(back, CV_32F, -0.5);
  cv::Mat3f out;
  warp_back(picture, back, cv::INTER_CUBIC).convertTo(out, CV_32F);
  return out;
}

}  // namespace

cv::Mat middle_frame(const cv::Mat& a, const cv::Mat& b, const FlowPair& flow) {
  const Arrived from_a = carried(flow.a_to_b, flow.b_to_a), from_b = carried(flow.b_to_a, flow.a_to_b);
  const cv::Mat3f of_a = looked_up(a, from_a.motion), of_b = looked_up(b, from_b.motion);
  cv::Mat3b out(a.size());
  for (int y = 0; y < out.rows; ++y)
    for (int x = 0; x < out.cols; ++x) {
      const float wa = from_a.weight(y, x) + 1e-4F, wb = from_b.weight(y, x) + 1e-4F;
      const cv::Vec3f mean = (wa * of_a(y, x) + wb * of_b(y, x)) / (wa + wb);
      for (int c = 0; c < 3; ++c) out(y, x)[c] = cv::saturate_cast<uchar>(mean[c]);
    }
  return out;
}

double psnr_db(const cv::Mat& picture, const cv::Mat& truth) {
  const double squared = cv::norm(picture, truth, cv::NORM_L2SQR) / static_cast<double>(3 * truth.total());
  return 10 * std::log10(255 * 255 / std::max(1e-9, squared));
}

}  // namespace vantage
