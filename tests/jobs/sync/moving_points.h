#pragma once
/// Points that move in front of two cameras: exact paths, known offset, noise and wrong matches as asked for.
#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "jobs/sync/epipolar_fit.h"

namespace vantage::sync::testing_support {

constexpr double kFps = 30;

struct Rig {
  Calibration calibration;
  FrameTable table_a{"a", 640, 360, kFps, {}}, table_b{"b", 640, 360, kFps, {}};
  PairGeometry geometry() const {
    return {CameraPath(calibration, table_a, false), CameraPath(calibration, table_b, false)};
  }
  Eigen::Vector2d project(const std::string& camera, const Eigen::Vector3d& X) const {
    return calibration.camera(camera).pinhole.project(calibration.pose({camera, 0}) * X);
  }
};

inline RigidTransform looking_at_origin(const Eigen::Vector3d& centre) {
  const Eigen::Vector3d front = -centre.normalized(), right = Eigen::Vector3d::UnitY().cross(front).normalized();
  RigidTransform pose;
  pose.R.row(0) = right;
  pose.R.row(1) = front.cross(right);
  pose.R.row(2) = front;
  pose.t = -pose.R * centre;
  return pose;
}

/// Two cameras 5 m from the origin, y down; b higher than a unless `level`.
inline Rig make_rig(int num_frames, bool level = false) {
  Rig rig;
  for (const std::string name : {"a", "b"}) {
    rig.calibration.cameras[name] = {name, name == "a" ? 1 : 2, {640, 360, 600, 600, 320, 180}, std::nullopt};
    const Eigen::Vector3d centre =
        name == "a" ? Eigen::Vector3d(-0.6, 0, -5) : Eigen::Vector3d(0.6, level ? 0 : -0.5, -5);
    for (int f = 0; f < num_frames; ++f) rig.calibration.cam_from_world[{name, f}] = looking_at_origin(centre);
  }
  for (int f = 0; f < num_frames; ++f) {
    rig.table_a.pts_s.push_back(f / kFps);
    rig.table_b.pts_s.push_back(f / kFps);
  }
  return rig;
}

/// p0 + v t + amplitude sin(w t + phase)
struct Motion {
  Eigen::Vector3d p0, v, amplitude;
  double w = 0, phase = 0;
  Eigen::Vector3d wander = Eigen::Vector3d::Zero();
  Eigen::Vector3d at(double t) const {
    return p0 + v * t + amplitude * std::sin(w * t + phase) + wander * std::sin(0.37 * w * t * (1 + 0.01 * t));
  }
};

/// Wandering: stays in view for a minute without repeating itself. Still: does not move.
enum class Kind { Free, AlongBaseline, Periodic, Wandering, Still };

inline Motion random_motion(std::mt19937& random, Kind kind) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&](double x, double y, double z) -> Eigen::Vector3d {
    const double a = uniform(random), b = uniform(random), c = uniform(random);
    return {a * x, b * y, c * z};
  };
  Motion m{vector(1, 0.6, 0.6), vector(1, 1, 1), vector(0.15, 0.15, 0.15), 0, 0, Eigen::Vector3d::Zero()};
  m.w = 4 + 2 * uniform(random);
  m.phase = 3 * uniform(random);
  if (kind == Kind::AlongBaseline) m.v.tail<2>().setZero(), m.amplitude.tail<2>().setZero();
  if (kind == Kind::Periodic) m.v.setZero(), m.amplitude *= 2, m.w = 2 * M_PI / 0.5;
  if (kind == Kind::Wandering) m.v.setZero(), m.wander = vector(0.4, 0.4, 0.4);
  if (kind == Kind::Still) m.v.setZero(), m.amplitude.setZero();
  return m;
}

struct Asked {
  int num = 60;
  double offset_s = 0;  ///< t_a = offset_s + rate t_b
  double rate = 1;
  double noise_px = 0;
  double wrong_share = 0;  ///< of the pairs, b is another point
  Kind kind = Kind::Free;
  unsigned seed = 1;
};

inline std::vector<PathPair> make_pairs(const Rig& rig, const Asked& asked) {
  std::mt19937 random(asked.seed);
  std::normal_distribution<double> noise(0, 1);
  std::vector<PathPair> pairs;
  const auto path = [&](const FrameTable& table, const Motion& motion, double offset_s, double rate) {
    std::vector<Eigen::Vector2d> px;
    for (const double t : table.pts_s) {
      const double dx = noise(random), dy = noise(random);
      px.push_back(rig.project(table.camera, motion.at(offset_s + rate * t)) +
                   asked.noise_px * Eigen::Vector2d(dx, dy));
    }
    return TimedTrack(table.pts_s, std::move(px));
  };
  for (int k = 0; k < asked.num; ++k) {
    const Motion motion = random_motion(random, asked.kind), other = random_motion(random, asked.kind);
    const bool wrong = k < asked.wrong_share * asked.num;
    pairs.push_back(
        {path(rig.table_a, motion, 0, 1), path(rig.table_b, wrong ? other : motion, asked.offset_s, asked.rate)});
  }
  return pairs;
}

}  // namespace vantage::sync::testing_support
