#include "jobs/depth/triangulate_edge.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace vantage {
namespace {

/// A match whose motion is not known counts this much: it may be of something that moved.
constexpr float kUnknownMotionConfidence = 0.25F;
/// What a good match is off by, along the line as across it.
constexpr double kMatch_px = 0.3;
/// How much of a way carried in time may be wrong: motion is neither straight nor even, and matched itself.
constexpr double kCarriedShare = 0.3;

/// A row's matches in the other image, at the image's moment.
struct RowEnds {
  std::vector<double> x_px, y_px;
  std::vector<double> carried_px;  ///< how far time has moved them
  std::vector<float> confidence;   ///< 0: none

  explicit RowEnds(std::size_t width) : x_px(width), y_px(width), carried_px(width), confidence(width) {}
};

void take_matches(const FlowMap& to_other, int y, RowEnds& row) {
  const cv::Vec2f* motion = to_other.motion_px[y];
  const float* confidence = to_other.confidence[y];
  for (std::size_t x = 0; x < row.x_px.size(); ++x) {
    row.x_px[x] = static_cast<double>(x) + 0.5 + motion[x][0];
    row.y_px[x] = y + 0.5 + motion[x][1];
    row.confidence[x] = confidence[x] * confidence[x];
  }
}

/// To where the points were, or will be, lag_s later.
void carry(const StepFlow& step, double lag_s, RowEnds& row) {
  const cv::Mat2f& flow = step.flow.motion_px;
  const double share = lag_s / step.duration_s;
  for (std::size_t k = 0; k < row.x_px.size(); ++k) {
    if (row.confidence[k] <= 0) continue;
    const int x = static_cast<int>(std::floor(row.x_px[k])), y = static_cast<int>(std::floor(row.y_px[k]));
    if (x < 0 || y < 0 || x >= flow.cols || y >= flow.rows) {
      row.confidence[k] = 0;
      continue;
    }
    // The nearest pixel's motion, not a mixture across the outline of what moves.
    const cv::Vec2f motion = flow(y, x);
    row.x_px[k] += share * motion[0];
    row.y_px[k] += share * motion[1];
    row.carried_px[k] = std::abs(share) * std::hypot(motion[0], motion[1]);
    row.confidence[k] *= std::max(kUnknownMotionConfidence, step.flow.confidence(y, x));
  }
}

struct Gates {
  double max_epipolar_px, min_parallax_px;
};

/// fit_inverse_depth of jobs/vision/epipolar.h, for a row at once.
void solve(const TwoView& views, int y, const RowEnds& row, const Gates& gates, float* inverse_depth, float* weight) {
  const Eigen::Vector3d start = views.homogeneous({0.5, y + 0.5}, 0), right = views.H.col(0), e = views.e;
  const double max_squared = gates.max_epipolar_px * gates.max_epipolar_px;
  for (std::size_t k = 0; k < row.x_px.size(); ++k) {
    inverse_depth[k] = weight[k] = 0;
    if (row.confidence[k] <= 0) continue;
    const auto x = static_cast<double>(k);
    const double nx = start.x() + x * right.x(), ny = start.y() + x * right.y(), nz = start.z() + x * right.z();
    const double px = row.x_px[k], py = row.y_px[k];
    const double slope_x = e.x() - px * e.z(), slope_y = e.y() - py * e.z();
    const double squared = slope_x * slope_x + slope_y * slope_y;
    if (squared < 1e-12) continue;
    const double w = (slope_x * (px * nz - nx) + slope_y * (py * nz - ny)) / squared;
    const double qx = nx + w * e.x(), qy = ny + w * e.y(), qz = nz + w * e.z();
    if (w <= 0 || qz <= 1e-9) continue;
    const double off_x = qx / qz - px, off_y = qy / qz - py, off_squared = off_x * off_x + off_y * off_y;
    const double px_per_inverse_depth = std::hypot(e.x() * qz - qx * e.z(), e.y() * qz - qy * e.z()) / (qz * qz);
    // Parallax from infinity to the point, over the focal length: the tangent of the angle between the rays.
    if (off_squared > max_squared || px_per_inverse_depth * w < gates.min_parallax_px) continue;
    const double carried = kCarriedShare * row.carried_px[k];
    // A match that is off its line is likely to be off by as much along it.
    const double variance_px = kMatch_px * kMatch_px + off_squared + carried * carried;
    inverse_depth[k] = static_cast<float>(w);
    weight[k] = static_cast<float>(row.confidence[k] * px_per_inverse_depth * px_per_inverse_depth / variance_px);
  }
}

}  // namespace

EdgeDepth triangulate_edge(const TwoView& views, double other_focal_px, const FlowMap& to_other, double lag_s,
                           const std::optional<StepFlow>& step, const TriangulateOptions& options) {
  const cv::Size size = to_other.motion_px.size();
  EdgeDepth depth{cv::Mat1f(size), cv::Mat1f(size)};
  const Gates gates{.max_epipolar_px = options.max_epipolar_px,
                    .min_parallax_px = other_focal_px * std::tan(options.min_angle_deg * std::numbers::pi / 180)};
  RowEnds row(static_cast<std::size_t>(size.width));
  for (int y = 0; y < size.height; ++y) {
    take_matches(to_other, y, row);
    if (step) carry(*step, lag_s, row);
    solve(views, y, row, gates, depth.inverse_depth[y], depth.weight[y]);
  }
  return depth;
}

}  // namespace vantage
