#pragma once
/// Spheres that move in front of two static cameras, as exact outlines.
#include <cmath>
#include <functional>

#include "jobs/sync/frontier_offset.h"
#include "tests/jobs/sync/moving_points.h"

namespace vantage::sync::testing_support {

struct Sphere {
  double radius = 0.2;
  std::function<Eigen::Vector3d(double shot_time_s)> centre;
};

/// A thrown thing and one that wanders: motion across most epipolar planes, never twice the same.
inline std::vector<Sphere> two_spheres() {
  return {{0.25,
           [](double t) -> Eigen::Vector3d {
             return {0.3 * std::sin(2 * t), 0.4 * std::sin(2.3 * t + 1) + 0.2 * std::sin(5.1 * t), 0.3 * std::cos(t)};
           }},
          {0.12, [](double t) -> Eigen::Vector3d {
             return {0.8 * std::cos(1.3 * t), 0.9 * std::sin(1.1 * t) * std::cos(2.9 * t), 0.5};
           }}};
}

/// Cameras 5 m from the origin, `apart_deg` apart, b half a metre higher.
inline Rig make_wide_rig(int num_frames, double apart_deg) {
  Rig rig = make_rig(num_frames);
  const double half = apart_deg * M_PI / 360;
  for (int f = 0; f < num_frames; ++f) {
    rig.calibration.cam_from_world[{"a", f}] = looking_at_origin({-5 * std::sin(half), 0, -5 * std::cos(half)});
    rig.calibration.cam_from_world[{"b", f}] = looking_at_origin({5 * std::sin(half), -0.5, -5 * std::cos(half)});
  }
  return rig;
}

/// Cells whose ray meets a sphere; t_shot = start_s + rate · t_footage.
inline MovingAreas film(const Rig& rig, const FrameTable& table, const std::vector<Sphere>& spheres, double start_s,
                        double rate = 1) {
  const Pinhole& pinhole = rig.calibration.camera(table.camera).pinhole;
  MovingAreas areas{table.camera, 2, pinhole.width / 2, pinhole.height / 2, {}};
  for (int f = 0; f < table.num_frames(); ++f) {
    auto& runs = areas.frames.emplace_back();
    const RigidTransform pose = rig.calibration.pose({table.camera, f});
    const double t = start_s + rate * table.pts_s[static_cast<std::size_t>(f)];
    const auto hit = [&](int x, int y) {
      const Eigen::Vector3d ray = pinhole.ray(2 * Eigen::Vector2d(x + 0.5, y + 0.5)).normalized();
      for (const Sphere& s : spheres)
        if (const Eigen::Vector3d c = pose * s.centre(t); (c - ray * ray.dot(c)).norm() < s.radius) return true;
      return false;
    };
    for (int y = 0; y < areas.rows; ++y)
      for (int x = 0; x < areas.columns; ++x) {
        const int begin = x;
        while (x < areas.columns && hit(x, y)) ++x;
        if (x > begin)
          runs.push_back(
              {static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(x)});
      }
  }
  return areas;
}

}  // namespace vantage::sync::testing_support
