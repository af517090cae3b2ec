#include "jobs/reconstruct/interest_points.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

namespace vantage {
namespace {

double strong_corner(const cv::Mat1f& least_eigenvalue) {
  std::vector<float> values(least_eigenvalue.begin(), least_eigenvalue.end());
  const auto k = values.begin() + static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), k, values.end());
  return *k;
}

/// Offset of the maximum of the parabola through three samples, within half a sample.
double parabola_peak(double before, double at, double after) {
  const double curvature = before - 2 * at + after;
  return curvature < -1e-12 ? std::clamp(0.5 * (before - after) / curvature, -0.5, 0.5) : 0.0;
}

bool is_peak(const cv::Mat1f& m, int x, int y) {
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx)
      if (m(y + dy, x + dx) > m(y, x)) return false;
  return true;
}

/// Strongest local maximum of a cell, or (-1, -1).
cv::Point best_of_cell(const cv::Mat1f& m, cv::Rect cell, double least) {
  cv::Point best(-1, -1);
  for (int y = cell.y; y < cell.y + cell.height; ++y)
    for (int x = cell.x; x < cell.x + cell.width; ++x)
      if (m(y, x) > least && is_peak(m, x, y) && (best.x < 0 || m(y, x) > m(best))) best = {x, y};
  return best;
}

std::vector<Eigen::Vector2d> corners(const cv::Mat1f& grey, const InterestPointOptions& options) {
  cv::Mat1f m;
  cv::cornerMinEigenVal(grey, m, 5, 3);
  const double least = options.quality * strong_corner(m);
  constexpr int kBorder = 6;
  std::vector<Eigen::Vector2d> out;
  for (int y = kBorder; y < grey.rows - kBorder; y += options.grid_px)
    for (int x = kBorder; x < grey.cols - kBorder; x += options.grid_px) {
      const cv::Rect cell(x, y, std::min(options.grid_px, grey.cols - kBorder - x),
                          std::min(options.grid_px, grey.rows - kBorder - y));
      const cv::Point p = best_of_cell(m, cell, std::max(least, 1e-6));
      if (p.x < 0) continue;
      out.emplace_back(p.x + 0.5 + parabola_peak(m(p.y, p.x - 1), m(p), m(p.y, p.x + 1)),
                       p.y + 0.5 + parabola_peak(m(p.y - 1, p.x), m(p), m(p.y + 1, p.x)));
    }
  return out;
}

}  // namespace

Eigen::Vector3d common_up(const ViewGroup& group) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const View& view : group.views) up -= view.cam_from_world.R.row(1).transpose();
  return up.norm() > 1e-6 ? up.normalized() : Eigen::Vector3d(-group.views.front().cam_from_world.R.row(1).transpose());
}

InterestPoints find_interest_points(const View& view, const Eigen::Vector3d& up, const InterestPointOptions& options) {
  InterestPoints points;
  points.px = corners(view.grey, options);
  if (points.px.empty()) return points;
  const Eigen::Vector3d up_in_cam = view.cam_from_world.R * up;
  const double angle_deg = std::atan2(up_in_cam.x(), -up_in_cam.y()) * 180 / std::numbers::pi;
  std::vector<cv::KeyPoint> keypoints;
  for (const auto& px : points.px)
    keypoints.emplace_back(cv::Point2f(static_cast<float>(px.x() - 0.5), static_cast<float>(px.y() - 0.5)),
                           static_cast<float>(options.descriptor_px),
                           static_cast<float>(angle_deg < 0 ? angle_deg + 360 : angle_deg));
  cv::Mat1b grey;
  view.grey.convertTo(grey, CV_8U);
  const std::size_t count = keypoints.size();
  cv::SIFT::create()->compute(grey, keypoints, points.descriptors);
  if (keypoints.size() != count) {  // SIFT may drop points: keep what it described
    points.px.clear();
    for (const auto& k : keypoints) points.px.emplace_back(k.pt.x + 0.5, k.pt.y + 0.5);
  }
  for (int i = 0; i < points.descriptors.rows; ++i) cv::normalize(points.descriptors.row(i), points.descriptors.row(i));
  return points;
}

}  // namespace vantage
