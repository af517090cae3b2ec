#include "jobs/fuse/patch_spacing.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace vantage {
namespace {

double nearest_distance(const std::vector<Patch>& group, std::size_t of) {
  float least = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < group.size(); ++i)
    if (i != of) least = std::min(least, (group[i].position - group[of].position).squaredNorm());
  return std::sqrt(static_cast<double>(least));
}

}  // namespace

PixelFootprint::PixelFootprint(const Calibration& calibration) {
  for (const auto& [name, camera] : calibration.cameras) {
    const auto pose = calibration.cam_from_world.lower_bound({name, 0});
    if (pose != calibration.cam_from_world.end() && pose->first.camera == name)
      cameras_.push_back({camera.pinhole, pose->second});
  }
}

double PixelFootprint::operator()(const Eigen::Vector3f& point, const Eigen::Vector3f& normal) const {
  double finest = std::numeric_limits<double>::infinity(), nearest = finest;
  for (const Camera& c : cameras_) {
    const Eigen::Vector3d p = c.cam_from_world * point.cast<double>();
    if (p.z() <= 0) continue;
    const double width = p.z() / c.pinhole.fx;
    nearest = std::min(nearest, width);
    const Eigen::Vector2d px = c.pinhole.project(p);
    const bool faces = (c.cam_from_world.R * normal.cast<double>()).dot(p) < 0;
    if (faces && px.x() >= 0 && px.y() >= 0 && px.x() < c.pinhole.width && px.y() < c.pinhole.height)
      finest = std::min(finest, width);
  }
  return std::isfinite(finest) ? finest : nearest;
}

PatchSpacing measure_spacing(const std::vector<std::vector<Patch>>& groups, const PixelFootprint& footprint) {
  constexpr std::size_t kSamplesPerGroup = 100;
  std::vector<double> ratios;
  for (const auto& group : groups) {
    const std::size_t step = std::max<std::size_t>(1, group.size() / kSamplesPerGroup);
    for (std::size_t i = 0; group.size() > 1 && i < group.size(); i += step) {
      const double ratio = nearest_distance(group, i) / footprint(group[i].position, group[i].normal);
      if (std::isfinite(ratio) && ratio > 0) ratios.push_back(ratio);
    }
  }
  double ratio = 2;  // a single patch: the reconstruction's default cell
  if (!ratios.empty()) {
    const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
    std::nth_element(ratios.begin(), middle, ratios.end());
    ratio = *middle;
  }
  return [footprint, ratio](const Patch& p) { return ratio * footprint(p.position, p.normal); };
}

}  // namespace vantage
