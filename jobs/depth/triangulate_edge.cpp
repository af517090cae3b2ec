#include "jobs/depth/triangulate_edge.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vantage {
namespace {

/// A match whose motion is not known counts this much: it may be of something that moved.
constexpr float kUnknownMotionConfidence = 0.25F;

struct Carried {
  Eigen::Vector2d px;
  float confidence = 0;
};

/// Where the point seen at px in the other image was, or will be, lag_s later.
Carried carry(const Eigen::Vector2d& px, double lag_s, const StepFlow& step) {
  const int x = static_cast<int>(std::floor(px.x())), y = static_cast<int>(std::floor(px.y()));
  if (x < 0 || y < 0 || x >= step.flow.motion_px.cols || y >= step.flow.motion_px.rows) return {px, 0};
  // The nearest pixel's motion, not a mixture across the outline of what moves.
  const cv::Vec2f motion = step.flow.motion_px(y, x);
  const double share = lag_s / step.duration_s;
  return {px + share * Eigen::Vector2d(motion[0], motion[1]),
          std::max(kUnknownMotionConfidence, step.flow.confidence(y, x))};
}

}  // namespace

EdgeDepth triangulate_edge(const TwoView& views, double other_focal_px, const FlowMap& to_other, double lag_s,
                           const std::optional<StepFlow>& step, const TriangulateOptions& options) {
  const cv::Size size = to_other.motion_px.size();
  EdgeDepth depth{cv::Mat1f(size, 0.0F), cv::Mat1f(size, 0.0F)};
  const double min_parallax_px = other_focal_px * std::tan(options.min_angle_deg * std::numbers::pi / 180);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const float confidence = to_other.confidence(y, x);
      if (confidence <= 0) continue;
      const cv::Vec2f motion = to_other.motion_px(y, x);
      const Eigen::Vector2d px(x + 0.5, y + 0.5);
      Carried end{px + Eigen::Vector2d(motion[0], motion[1]), 1};
      if (step) end = carry(end.px, lag_s, *step);
      const auto fit = fit_inverse_depth(views, px, end.px);
      if (!fit || end.confidence <= 0 || fit->inverse_depth <= 0 || fit->residual_px > options.max_epipolar_px)
        continue;
      // Parallax from infinity to the point, over the focal length: the tangent of the angle between the rays.
      if (fit->px_per_inverse_depth * fit->inverse_depth < min_parallax_px) continue;
      depth.inverse_depth(y, x) = static_cast<float>(fit->inverse_depth);
      depth.strength(y, x) = static_cast<float>(fit->px_per_inverse_depth) * std::sqrt(confidence * end.confidence);
    }
  return depth;
}

}  // namespace vantage
