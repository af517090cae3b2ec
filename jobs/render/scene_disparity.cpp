#include "jobs/render/scene_disparity.h"

#include <cmath>

namespace vantage {
namespace {

/// About this many pixels of an image tell as much as all of them.
constexpr double kSamples = 60000;

void add_depth(DisparityHistogram& histogram, const DisparityKnot& knot, const KnotDepth& depth) {
  const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(depth.z.total()) / kSamples)));
  const RigidTransform& image = depth.cam_from_world;
  const Eigen::Matrix3d turn = knot.cam_from_world.R * image.R.transpose();
  const Eigen::Vector3d shift = knot.cam_from_world.t - turn * image.t;
  for (int y = step / 2; y < depth.z.rows; y += step)
    for (int x = step / 2; x < depth.z.cols; x += step) {
      const double z = depth.z(y, x);
      if (!(z > 0)) continue;
      const Eigen::Vector3d p = turn * (z * depth.pinhole.ray({x + 0.5, y + 0.5})) + shift;
      if (!(p.z() > 0)) continue;
      const Eigen::Vector2d px = knot.pinhole.project(p);
      if (!(px.x() >= 0 && px.y() >= 0 && px.x() < knot.pinhole.width && px.y() < knot.pinhole.height)) continue;
      histogram.add(knot.rig.disparity_px(p.z()), z * z / (p.z() * p.z()));
    }
}

}  // namespace

DisparityHistogram scene_disparities(const DisparityKnot& knot, std::span<const KnotDepth> depths) {
  DisparityHistogram histogram(knot.pinhole.width);
  for (const KnotDepth& depth : depths) add_depth(histogram, knot, depth);
  return histogram;
}

}  // namespace vantage
