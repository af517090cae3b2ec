#include "jobs/vision/patch_picture.h"

#include <algorithm>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace vantage {
namespace {

/// Speed that 98 % of the moving patches stay below.
float fast_speed(std::span<const Patch> patches) {
  std::vector<float> speeds;
  for (const Patch& p : patches)
    if (p.velocity.norm() > 0) speeds.push_back(p.velocity.norm());
  if (speeds.empty()) return 1;
  const auto k = speeds.begin() + static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(speeds.size() - 1));
  std::nth_element(speeds.begin(), k, speeds.end());
  return *k;
}

cv::Mat3b turbo_colours() {
  cv::Mat1b levels(1, 256);
  for (int i = 0; i < 256; ++i) levels(0, i) = static_cast<uchar>(i);
  cv::Mat3b colours;
  cv::applyColorMap(levels, colours, cv::COLORMAP_TURBO);
  return colours;
}

}  // namespace

PatchPictures patch_pictures(std::span<const Patch> patches, const Pinhole& pinhole,
                             const RigidTransform& cam_from_world, float time_s, int splat_px) {
  const cv::Size size(pinhole.width, pinhole.height);
  PatchPictures out{cv::Mat3b(size, cv::Vec3b(0, 0, 0)), cv::Mat3b(size, cv::Vec3b(0, 0, 0))};
  cv::Mat1f nearest(size, std::numeric_limits<float>::infinity());
  const cv::Mat3b turbo = turbo_colours();
  const float fast = fast_speed(patches);
  constexpr float kSlack = 1e-3F;  // seconds: time stamps of a group's ends are rounded
  for (const Patch& p : patches) {
    if (time_s < p.t0_s - kSlack || time_s > p.t1_s + kSlack) continue;
    const Eigen::Vector3d point = cam_from_world * p.position_at(time_s).cast<double>();
    if (point.z() <= 0 || (cam_from_world.R * p.normal.cast<double>()).dot(point) > 0) continue;
    const Eigen::Vector2d px = pinhole.project(point);
    const float level = std::min(1.0F, p.velocity.norm() / fast);
    if (!(px.cwiseAbs().maxCoeff() < 1e6)) continue;
    const int x0 = static_cast<int>(std::floor(px.x() - 0.5 * (splat_px - 1))),
              y0 = static_cast<int>(std::floor(px.y() - 0.5 * (splat_px - 1)));
    for (int y = std::max(0, y0); y < std::min(size.height, y0 + splat_px); ++y)
      for (int x = std::max(0, x0); x < std::min(size.width, x0 + splat_px); ++x) {
        if (static_cast<float>(point.z()) >= nearest(y, x)) continue;
        nearest(y, x) = static_cast<float>(point.z());
        out.colour(y, x) = {p.rgb[2], p.rgb[1], p.rgb[0]};
        out.speed(y, x) = turbo(0, cvRound(255 * level));
      }
  }
  return out;
}

cv::Mat patch_preview(std::span<const Patch> patches, const Pinhole& pinhole, const RigidTransform& cam_from_world,
                      float time_s) {
  constexpr int kWidth = 240;
  const double scale = static_cast<double>(kWidth) / pinhole.width;
  const Pinhole small{kWidth,
                      std::max(1, static_cast<int>(pinhole.height * scale)),
                      pinhole.fx * scale,
                      pinhole.fy * scale,
                      pinhole.cx * scale,
                      pinhole.cy * scale};
  const PatchPictures pictures = patch_pictures(patches, small, cam_from_world, time_s, 2);
  cv::Mat both;
  cv::hconcat(pictures.colour, pictures.speed, both);
  return both;
}

}  // namespace vantage
