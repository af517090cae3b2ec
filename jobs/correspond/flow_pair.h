#pragma once
#include <opencv2/core.hpp>

namespace vantage {

/// Motion fields both ways between two pictures a and b of any sizes: pixel x of a lies at x + a_to_b(x) in b.
struct FlowPair {
  cv::Mat2f a_to_b, b_to_a;
};

/// |forward(x) + backward(x + forward(x))| in px, the backward field bilinear; kOutOfFrame_px where x + forward(x) is
/// outside.
constexpr float kOutOfFrame_px = 1e3F;
cv::Mat1f round_trip_px(const cv::Mat2f& forward, const cv::Mat2f& backward);

/// What `picture` (of b) shows at x + motion(x): bilinear, border repeated. Any type that cv::remap takes.
cv::Mat warp_back(const cv::Mat& picture, const cv::Mat2f& motion, int interpolation);

}  // namespace vantage
