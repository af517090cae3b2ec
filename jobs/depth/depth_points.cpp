#include "jobs/depth/depth_points.h"

#include <Eigen/Geometry>
#include <cmath>
#include <optional>

namespace vantage {
namespace {

constexpr float kOneSurface = 0.05F;

Eigen::Vector3d point_in_cam(const Pinhole& pinhole, const cv::Mat1f& z, int x, int y) {
  return pinhole.ray({x + 0.5, y + 0.5}) * static_cast<double>(z(y, x));
}

/// From one neighbour to the other along an axis, or to the one that is of this surface.
std::optional<Eigen::Vector3d> tangent(const Pinhole& pinhole, const cv::Mat1f& z, cv::Point at, cv::Point step) {
  const cv::Rect frame({}, z.size());
  const auto same = [&](cv::Point p) {
    return frame.contains(p) && z(p) > 0 && std::abs(z(p) - z(at)) <= kOneSurface * z(at);
  };
  const cv::Point a = same(at - step) ? at - step : at, b = same(at + step) ? at + step : at;
  if (a == b) return {};
  return point_in_cam(pinhole, z, b.x, b.y) - point_in_cam(pinhole, z, a.x, a.y);
}

struct Seen {
  Eigen::Vector3d in_world;
  double px_per_unit;  ///< how large this camera sees it
};

/// What a camera says of the surface at a world point: empty when it does not see it there.
std::optional<Seen> seen_by(const PosedDepth& image, const Eigen::Vector3d& in_world, const DepthPointsOptions& o) {
  const Eigen::Vector3d p = image.cam_from_world * in_world;
  if (p.z() <= 0) return {};
  const Eigen::Vector2d px = image.pinhole.project(p);
  if (!(px.x() >= 0 && px.y() >= 0 && px.x() < image.depth.z.cols && px.y() < image.depth.z.rows)) return {};
  const int x = static_cast<int>(px.x()), y = static_cast<int>(px.y());
  const double z = image.depth.z(y, x);
  if (z <= 0 || image.depth.confidence(y, x) < o.min_confidence || std::abs(z - p.z()) > o.agreement * p.z()) return {};
  const Eigen::Vector3d there = image.pinhole.ray(px) * z;
  return Seen{image.cam_from_world.R.transpose() * (there - image.cam_from_world.t), image.pinhole.fx / z};
}

/// The point at a pixel of image i; empty when too few agree, or when another camera tells of it in more detail.
std::optional<Patch> point_at(std::span<const PosedDepth> images, std::size_t i, int x, int y,
                              const DepthPointsOptions& options) {
  const PosedDepth& image = images[i];
  const double z = image.depth.z(y, x);
  if (z <= 0 || image.depth.confidence(y, x) < options.min_confidence) return {};
  const RigidTransform& pose = image.cam_from_world;
  const Eigen::Vector3d own = pose.R.transpose() * (point_in_cam(image.pinhole, image.depth.z, x, y) - pose.t);
  Eigen::Vector3d sum = own;
  int num_cameras = 1;
  for (std::size_t k = 0; k < images.size(); ++k) {
    if (k == i) continue;
    const auto seen = seen_by(images[k], own, options);
    if (!seen) continue;
    const double own_px_per_unit = image.pinhole.fx / z;
    if (seen->px_per_unit > own_px_per_unit || (seen->px_per_unit == own_px_per_unit && k < i)) return {};
    sum += seen->in_world;
    ++num_cameras;
  }
  if (num_cameras < options.min_cameras) return {};
  const Eigen::Vector3f normal = normal_in_cam(image.pinhole, image.depth.z, x, y);
  if (normal.isZero()) return {};
  Patch point;
  point.position = (sum / num_cameras).cast<float>();
  point.normal = pose.R.transpose().cast<float>() * normal;
  const cv::Vec3b& bgr = image.bgr(y, x);
  point.rgb = {bgr[2], bgr[1], bgr[0]};
  point.num_views = num_cameras;
  return point;
}

}  // namespace

Eigen::Vector3f normal_in_cam(const Pinhole& pinhole, const cv::Mat1f& z, int x, int y) {
  const auto right = tangent(pinhole, z, {x, y}, {1, 0}), down = tangent(pinhole, z, {x, y}, {0, 1});
  if (!right || !down) return Eigen::Vector3f::Zero();
  return down->cross(*right).normalized().cast<float>();
}

std::vector<Patch> consistent_points(std::span<const PosedDepth> images, const DepthPointsOptions& options) {
  std::vector<Patch> points;
  for (std::size_t i = 0; i < images.size(); ++i)
    for (int y = 0; y < images[i].depth.z.rows; ++y)
      for (int x = 0; x < images[i].depth.z.cols; ++x)
        if (const auto point = point_at(images, i, x, y, options)) points.push_back(*point);
  return points;
}

}  // namespace vantage
