#include "jobs/correspond/coarse_to_fine_flow.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace vantage {
namespace {

constexpr double kLevelScale = 0.75;
constexpr int kMinSide_px = 20;
/// Blur that keeps a picture half the size free of aliasing, and in proportion (px of the larger picture).
constexpr double kBlurPerShrink_px = 0.6;

cv::Mat1f shrunk(const cv::Mat1f& picture, double scale) {
  cv::Mat1f blurred, small;
  cv::GaussianBlur(picture, blurred, {}, kBlurPerShrink_px * std::sqrt(1 / (scale * scale) - 1));
  const cv::Size size(cvRound(picture.cols * scale), cvRound(picture.rows * scale));
  cv::resize(blurred, small, size, 0, 0, cv::INTER_LINEAR);
  return small;
}

}  // namespace

cv::Mat2f resized_motion(const cv::Mat2f& motion, cv::Size size) {
  if (motion.size() == size) return motion;
  cv::Mat2f out;
  cv::resize(motion, out, size, 0, 0, cv::INTER_LINEAR);
  const double sx = static_cast<double>(size.width) / motion.cols, sy = static_cast<double>(size.height) / motion.rows;
  cv::multiply(out, cv::Scalar(sx, sy), out);
  return out;
}

cv::Mat2f coarse_to_fine_flow(const cv::Mat1f& from, const cv::Mat1f& to, const VariationalOptions& options) {
  const int side = std::min(from.cols, from.rows);
  const int num_levels =
      std::max(0, static_cast<int>(std::log(static_cast<double>(kMinSide_px) / side) / std::log(kLevelScale)));
  cv::Mat2f motion;
  for (int level = num_levels; level >= 0; --level) {
    const double scale = std::pow(kLevelScale, level);
    const cv::Mat1f a = level == 0 ? from : shrunk(from, scale), b = level == 0 ? to : shrunk(to, scale);
    motion = motion.empty() ? cv::Mat2f(a.size(), cv::Vec2f(0, 0)) : resized_motion(motion, a.size());
    refine_variational(a, b, {}, motion, options);
  }
  return motion;
}

}  // namespace vantage
