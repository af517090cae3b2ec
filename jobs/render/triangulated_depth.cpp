#include <Eigen/Core>
#include <cmath>

#include "jobs/render/pixel_places.h"

namespace vantage {
namespace {

constexpr double kMaxEpipolar_px = 2;
constexpr double kMinDisparity_px = 1;  ///< between the match and the point at infinity: less tells no depth

/// The depth along ray + z * 0 whose projection is nearest to a match: with p = a z + b, least squares of
/// match * p.z = p.xy, linear in z.
struct Ray {
  Eigen::Vector3d a, b;  ///< point in the other camera = a * z + b
};

struct Depth {
  double inverse = 0, weight = 0;
};

Depth depth_of(const Ray& ray, const Pinhole& other, const Eigen::Vector2d& match_px, double confidence) {
  const Eigen::Vector2d m((match_px.x() - other.cx) / other.fx, (match_px.y() - other.cy) / other.fy);
  const Eigen::Vector2d slope = ray.a.head<2>() - m * ray.a.z(), constant = ray.b.head<2>() - m * ray.b.z();
  const double z = -slope.dot(constant) / slope.squaredNorm();
  if (!(z > 0) || !std::isfinite(z)) return {};
  const Eigen::Vector3d p = ray.a * z + ray.b;
  if (p.z() <= 0 || ray.a.z() <= 0) return {};
  if ((other.project(p) - match_px).norm() > kMaxEpipolar_px) return {};
  const double disparity = (other.project(ray.a) - match_px).norm();  // grows with 1/z: its precision
  if (disparity < kMinDisparity_px) return {};
  return {1 / z, confidence * std::pow(disparity * z, 2)};
}

}  // namespace

DepthMap triangulated_depth(std::span<const SourceImage> images, int i) {
  const SourceImage& image = images[static_cast<std::size_t>(i)];
  cv::Mat1d sum(image.bgr.size(), 0.0), total(image.bgr.size(), 0.0);
  DepthMap depth{cv::Mat1f(image.bgr.size(), 0.0F), cv::Mat1f(image.bgr.size(), 0.0F)};
  for (const auto& [k, flow] : image.flows) {
    const SourceImage& other = images[static_cast<std::size_t>(k)];
    if (other.id.camera == image.id.camera) continue;
    const Eigen::Matrix3d R = other.cam_from_world.R * image.cam_from_world.R.transpose();
    const Eigen::Vector3d t = other.cam_from_world.t - R * image.cam_from_world.t;
    for (int y = 0; y < sum.rows; ++y)
      for (int x = 0; x < sum.cols; ++x) {
        const float confidence = flow.confidence(y, x);
        if (confidence <= 0) continue;
        const Eigen::Vector2d px(x + 0.5, y + 0.5);
        const cv::Vec2f motion = flow.motion_px(y, x);
        const Depth d = depth_of({R * image.pinhole.ray(px), t}, other.pinhole,
                                 px + Eigen::Vector2d(motion[0], motion[1]), confidence);
        sum(y, x) += d.weight * d.inverse;
        total(y, x) += d.weight;
        if (d.weight > 0) depth.confidence(y, x) = std::max(depth.confidence(y, x), confidence);
      }
  }
  for (int y = 0; y < sum.rows; ++y)
    for (int x = 0; x < sum.cols; ++x)
      if (sum(y, x) > 0) depth.z(y, x) = static_cast<float>(total(y, x) / sum(y, x));
  return depth;
}

}  // namespace vantage
