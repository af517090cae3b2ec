#include "jobs/calibrate/features.h"

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace vantage {
namespace {

// SIFT of OpenCV 4.6 doubles the picture such that its corners, not its pixels' centres, stay: what it reports at x
// lies at x - 0.25, counted from the centre of the first pixel. A test holds this against drawn blobs.
constexpr double kDoublingShiftPx = 0.25;
constexpr double kContrast = 0.02, kFaintContrast = 0.008;  // of the range of grey, times SIFT's three layers

double working_scale(const cv::Size& size, int max_side_px) {
  return std::min(2.0, static_cast<double>(max_side_px) / std::max(size.width, size.height));
}

cv::Mat scaled(const cv::Mat& picture, double scale, int enlarging) {
  cv::Mat out;
  cv::resize(picture, out, {}, scale, scale, scale < 1 ? cv::INTER_AREA : enlarging);
  return out;
}

void to_root_sift(Features::Descriptors& rows) {
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const float sum = rows.row(i).sum();
    rows.row(i) = (rows.row(i) / std::max(sum, 1e-6F)).cwiseSqrt();
  }
}

Eigen::Vector3i colour_at(const cv::Mat& bgr, const Eigen::Vector2d& px) {
  const int x = std::clamp(static_cast<int>(px.x()), 0, bgr.cols - 1);
  const int y = std::clamp(static_cast<int>(px.y()), 0, bgr.rows - 1);
  const auto& c = bgr.at<cv::Vec3b>(y, x);
  return {c[2], c[1], c[0]};
}

}  // namespace

Features find_features(const cv::Mat& bgr, const cv::Mat& mask, const FeatureOptions& options) {
  const double scale = working_scale(bgr.size(), options.max_side_px);
  cv::Mat grey;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  const cv::Mat picture = scaled(grey, scale, cv::INTER_CUBIC);
  const cv::Mat allowed = mask.empty() ? mask : scaled(mask, scale, cv::INTER_NEAREST);
  std::vector<cv::KeyPoint> points;
  cv::Mat1f descriptors;
  cv::SIFT::create(options.max_features, 3, options.faint ? kFaintContrast : kContrast)
      ->detectAndCompute(picture, allowed, points, descriptors);
  Features out;
  out.descriptors.resize(static_cast<Eigen::Index>(points.size()), 128);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& pt = points[i].pt;
    out.px.push_back(Eigen::Vector2d(pt.x - kDoublingShiftPx + 0.5, pt.y - kDoublingShiftPx + 0.5) / scale);
    out.rgb.push_back(colour_at(bgr, out.px.back()));
    const auto row = static_cast<int>(i);
    out.descriptors.row(row) = Eigen::Map<const Eigen::Matrix<float, 1, 128>>(descriptors.ptr<float>(row));
  }
  to_root_sift(out.descriptors);
  return out;
}

}  // namespace vantage
