#include "tests/support/synthetic_scene.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "tests/support/texture.h"

namespace vantage::synthetic {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

enum class Shape { Floor, Wall, Ball, Box };

struct Thing {
  int id;
  Shape shape;
  Vector3d size;  ///< ball: radius in x; box: half extents
};

constexpr int kBouncingBall = kFirstMovingId, kRisingBall = kFirstMovingId + 1, kTurningBox = kFirstMovingId + 2;
constexpr double kWallZ = 2.2;

const std::array<Thing, 7> kThings{{{0, Shape::Floor, {0, 0, 0}},
                                    {1, Shape::Wall, {0, 0, 0}},
                                    {2, Shape::Box, {0.28, 0.45, 0.28}},
                                    {3, Shape::Ball, {0.34, 0, 0}},
                                    {kBouncingBall, Shape::Ball, {0.26, 0, 0}},
                                    {kRisingBall, Shape::Ball, {0.2, 0, 0}},
                                    {kTurningBox, Shape::Box, {0.24, 0.3, 0.2}}}};

/// world_from_object at a shot time.
struct Placement {
  Matrix3d R = Matrix3d::Identity();
  Vector3d p = Vector3d::Zero();
};

Placement placement(int id, double t) {
  constexpr double kTau = 2 * std::numbers::pi;
  Placement at;
  switch (id) {
    case 2:
      at.p = {-1.15, -0.45, 0.55};
      break;
    case 3:
      at.p = {1.2, -0.34, 0.75};
      break;
    case kBouncingBall:
      at.p = {-0.55 + 0.45 * std::sin(kTau * 0.45 * t), -0.3 - 0.75 * std::pow(std::sin(kTau * 0.55 * t + 0.4), 2),
              -0.35 + 0.2 * std::cos(kTau * 0.3 * t)};
      break;
    case kRisingBall:
      at.p = {0.75 - 0.25 * std::sin(kTau * 0.4 * t), -0.75 - 0.5 * std::sin(kTau * 0.5 * t + 1.1),
              -0.25 - 0.15 * std::sin(kTau * 0.6 * t)};
      break;
    case kTurningBox: {
      const double angle = 0.5 + 1.1 * std::sin(kTau * 0.28 * t);
      at.R = Eigen::AngleAxisd(angle, Vector3d::UnitY()).toRotationMatrix();
      at.p = {0.12 + 0.3 * std::sin(kTau * 0.33 * t + 0.7), -0.42 - 0.12 * std::sin(kTau * 0.8 * t), 0.35};
      break;
    }
    default:
      break;
  }
  return at;
}

struct Hit {
  double distance = std::numeric_limits<double>::infinity();
  int id = -1;
  Vector3d normal = Vector3d::Zero();  ///< world
};

std::optional<double> hit_ball(const Vector3d& o, const Vector3d& d, double radius) {
  const double b = o.dot(d), q = b * b - d.squaredNorm() * (o.squaredNorm() - radius * radius);
  if (q <= 0) return std::nullopt;
  const double s = (-b - std::sqrt(q)) / d.squaredNorm();
  return s > 1e-6 ? std::optional(s) : std::nullopt;
}

/// Slab test; axis of the face that is hit goes to `axis`.
std::optional<double> hit_box(const Vector3d& o, const Vector3d& d, const Vector3d& half, int& axis) {
  double near = 1e-6, far = std::numeric_limits<double>::infinity();
  axis = -1;
  for (int i = 0; i < 3; ++i) {
    if (std::abs(d[i]) < 1e-12) {
      if (std::abs(o[i]) > half[i]) return std::nullopt;
      continue;
    }
    double a = (-half[i] - o[i]) / d[i], b = (half[i] - o[i]) / d[i];
    if (a > b) std::swap(a, b);
    if (a > near) {
      near = a;
      axis = i;
    }
    far = std::min(far, b);
  }
  return axis >= 0 && near <= far ? std::optional(near) : std::nullopt;
}

std::optional<double> hit_thing(const Thing& thing, const Placement& at, const Vector3d& origin,
                                const Vector3d& direction, Vector3d& normal) {
  if (thing.shape == Shape::Floor) {
    normal = -Vector3d::UnitY();
    const double s = -origin.y() / direction.y();
    return direction.y() > 1e-9 && s > 0 ? std::optional(s) : std::nullopt;
  }
  if (thing.shape == Shape::Wall) {
    normal = -Vector3d::UnitZ();
    const double s = (kWallZ - origin.z()) / direction.z();
    return direction.z() > 1e-9 && s > 0 ? std::optional(s) : std::nullopt;
  }
  const Vector3d o = at.R.transpose() * (origin - at.p), d = at.R.transpose() * direction;
  if (thing.shape == Shape::Ball) {
    const auto s = hit_ball(o, d, thing.size.x());
    if (s) normal = at.R * (o + *s * d).normalized();
    return s;
  }
  int axis = -1;
  const auto s = hit_box(o, d, thing.size, axis);
  if (s) normal = at.R * (Vector3d::Unit(axis) * (d[axis] > 0 ? -1.0 : 1.0));
  return s;
}

using Placements = std::array<Placement, kThings.size()>;

Placements placements_at(double t) {
  Placements all;
  for (std::size_t i = 0; i < kThings.size(); ++i) all[i] = placement(kThings[i].id, t);
  return all;
}

bool is_on(Stage stage, const Thing& thing) {
  if (stage == Stage::WithoutMoving) return thing.id < kFirstMovingId;
  return stage == Stage::Whole || thing.id >= kFirstMovingId || thing.shape == Shape::Wall ||
         thing.shape == Shape::Floor;
}

Hit trace(Stage stage, const Placements& at, const Vector3d& origin, const Vector3d& direction) {
  Hit best;
  for (std::size_t i = 0; i < kThings.size(); ++i) {
    if (!is_on(stage, kThings[i])) continue;
    Vector3d normal;
    const auto s = hit_thing(kThings[i], at[i], origin, direction, normal);
    if (s && *s < best.distance) best = {*s, kThings[i].id, normal};
  }
  return best;
}

const Vector3d kScreenBgr = Vector3d(kScreenRgb[2], kScreenRgb[1], kScreenRgb[0]) / 255;

Vector3d screen_shade(const Vector3d& point) {
  return kScreenBgr * (1 + 0.04 * std::sin(1.1 * point.x()) * std::cos(0.7 * point.z() + point.y()));
}

/// Light that the screen throws on a thing, most where it is seen at a slant.
Vector3d screen_spill(const Hit& hit, const Vector3d& towards_camera) {
  return 0.12 * kScreenBgr * std::pow(1 - std::abs(hit.normal.dot(towards_camera)), 2);
}

Vector3d shade(const Placements& at, const Hit& hit, const Vector3d& point) {
  if (hit.id < 0) return {0.85, 0.75, 0.7};
  static const Vector3d kLight = Vector3d(0.4, -0.8, -0.6).normalized();
  std::size_t index = 0;
  while (kThings[index].id != hit.id) ++index;
  const Vector3d local = at[index].R.transpose() * (point - at[index].p);
  return solid_texture(hit.id, local) * (0.55 + 0.45 * std::max(0.0, hit.normal.dot(kLight)));
}

Vector3d seen_along(Stage stage, const Placements& at, const Vector3d& origin, const Vector3d& direction) {
  const Hit hit = trace(stage, at, origin, direction);
  const Vector3d point = origin + hit.distance * direction;
  if (stage != Stage::GreenScreen) return shade(at, hit, point);
  if (hit.id < kFirstMovingId) return hit.id < 0 ? kScreenBgr : screen_shade(point);
  return shade(at, hit, point) + screen_spill(hit, direction.normalized());
}

double surface_distance(const Thing& thing, const Placement& at, const Vector3d& point) {
  if (thing.shape == Shape::Floor) return std::abs(point.y());
  if (thing.shape == Shape::Wall) return std::abs(point.z() - kWallZ);
  const Vector3d local = at.R.transpose() * (point - at.p);
  if (thing.shape == Shape::Ball) return std::abs(local.norm() - thing.size.x());
  const Vector3d q = local.cwiseAbs() - thing.size;
  return std::abs(q.cwiseMax(0.0).norm() + std::min(0.0, q.maxCoeff()));
}

}  // namespace

Scene::Scene(SceneOptions options) : options_(options) {}

Vector3d Scene::centre() const { return {0, -0.6, 0.2}; }

Picture Scene::render(const Pinhole& pinhole, const RigidTransform& cam_from_world, double time_s) const {
  const Placements at = placements_at(options_.moving ? time_s : 0);
  const Vector3d origin = cam_from_world.centre();
  const Matrix3d world_from_cam = cam_from_world.R.transpose();
  Picture picture{cv::Mat3b(pinhole.height, pinhole.width), cv::Mat1f(pinhole.height, pinhole.width, 0.F),
                  cv::Mat1b(pinhole.height, pinhole.width, uchar{255})};
  const int n = options_.supersample;
  cv::parallel_for_(cv::Range(0, pinhole.height), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y)
      for (int x = 0; x < pinhole.width; ++x) {
        Vector3d sum = Vector3d::Zero();
        for (int k = 0; k < n * n; ++k)
          sum += seen_along(options_.stage, at, origin,
                            world_from_cam * pinhole.ray({x + (k % n + 0.5) / n, y + (k / n + 0.5) / n}));
        sum *= 255.0 / (n * n);
        picture.bgr(y, x) = {cv::saturate_cast<uchar>(sum.x()), cv::saturate_cast<uchar>(sum.y()),
                             cv::saturate_cast<uchar>(sum.z())};
        const Hit centre_hit = trace(options_.stage, at, origin, world_from_cam * pinhole.ray({x + 0.5, y + 0.5}));
        if (centre_hit.id < 0) continue;
        picture.depth(y, x) = static_cast<float>(centre_hit.distance);  // rays have z = 1, so distance is depth
        picture.id(y, x) = static_cast<uchar>(centre_hit.id);
      }
  });
  if (options_.noise_sigma > 0) {
    cv::Mat noise(picture.bgr.size(), CV_16SC3);
    cv::RNG rng(static_cast<std::uint64_t>(std::llround(time_s * 1e6)) * 7919 +
                static_cast<std::uint64_t>(std::llround(origin.x() * 1e4) + 100000));
    rng.fill(noise, cv::RNG::NORMAL, 0.0, options_.noise_sigma);
    cv::add(picture.bgr, noise, picture.bgr, cv::noArray(), CV_8U);
  }
  return picture;
}

Vector3d Scene::moved(int id, const Vector3d& point, double time_from_s, double time_to_s) const {
  if (!options_.moving || id < kFirstMovingId) return point;
  const Placement from = placement(id, time_from_s), to = placement(id, time_to_s);
  return to.R * (from.R.transpose() * (point - from.p)) + to.p;
}

Vector3d Scene::velocity(int id, const Vector3d& point, double time_s) const {
  constexpr double kStep = 1e-4;
  return (moved(id, point, time_s, time_s + kStep) - moved(id, point, time_s, time_s - kStep)) / (2 * kStep);
}

double Scene::distance_to_surface(const Vector3d& point, double time_s) const {
  double best = std::numeric_limits<double>::infinity();
  for (const Thing& thing : kThings)
    if (is_on(options_.stage, thing))
      best = std::min(best, surface_distance(thing, placement(thing.id, options_.moving ? time_s : 0), point));
  return best;
}

Truth Scene::correspondence(const Picture& a, const Pinhole& pinhole_a, const RigidTransform& a_from_world,
                            double time_a_s, const Pinhole& pinhole_b, const RigidTransform& b_from_world,
                            double time_b_s) const {
  Truth truth{cv::Mat2f(a.depth.size(), cv::Vec2f(0, 0)), cv::Mat1b(a.depth.size(), uchar{0})};
  const Placements at_b = placements_at(options_.moving ? time_b_s : 0);
  const Vector3d origin_b = b_from_world.centre();
  for (int y = 0; y < a.depth.rows; ++y)
    for (int x = 0; x < a.depth.cols; ++x) {
      const double z = static_cast<double>(a.depth(y, x));
      if (z <= 0) continue;
      const Vector3d in_world = a_from_world.R.transpose() * (pinhole_a.ray({x + 0.5, y + 0.5}) * z - a_from_world.t);
      const Vector3d then = moved(a.id(y, x), in_world, time_a_s, time_b_s);
      const Vector3d in_b = b_from_world * then;
      if (in_b.z() <= 0) continue;
      const Eigen::Vector2d px = pinhole_b.project(in_b);
      truth.motion_px(y, x) = {static_cast<float>(px.x() - x - 0.5), static_cast<float>(px.y() - y - 0.5)};
      const bool in_frame = px.x() >= 0 && px.y() >= 0 && px.x() < pinhole_b.width && px.y() < pinhole_b.height;
      const Hit first = trace(options_.stage, at_b, origin_b, (then - origin_b) / in_b.z());
      if (in_frame && std::abs(first.distance - in_b.z()) < 0.01) truth.visible(y, x) = 255;
    }
  return truth;
}

RigidTransform SceneCamera::pose(int frame) const {
  // Slow sway at about half a hertz and tremor at about six: what hands do. Every camera has phases of its own.
  const double t = time_s(frame);
  const auto wave = [&](double hz, double phase) {
    return std::sin(2 * std::numbers::pi * (hz * t + phase + offset_s));
  };
  Vector3d walk, turn;
  for (int axis = 0; axis < 3; ++axis) {
    walk[axis] = sway_m * (wave(0.45 + 0.1 * axis, 0.3 * axis) + 0.1 * wave(5.7 + axis, 0.17 * axis));
    turn[axis] = sway_deg * (wave(0.35 + 0.15 * axis, 0.1 + 0.4 * axis) + 0.1 * wave(6.3 + axis, 0.29 * axis));
  }
  turn *= std::numbers::pi / 180;
  const Eigen::AngleAxisd by(turn.norm(), turn.norm() > 0 ? turn.normalized() : Vector3d(0, 0, 1));
  RigidTransform out;
  out.R = by.toRotationMatrix() * cam_from_world.R;
  out.t = -out.R * (cam_from_world.centre() + walk);
  return out;
}

std::vector<SceneCamera> arc_cameras(int num_cameras, int num_frames, int width, int height, double step_deg,
                                     double elevation_wobble_deg) {
  const Vector3d centre = Scene().centre();
  std::vector<SceneCamera> cameras;
  for (int i = 0; i < num_cameras; ++i) {
    const double azimuth = (i - (num_cameras - 1) / 2.0) * step_deg * std::numbers::pi / 180;
    const double elevation = (14 + (i % 2 == 0 ? -0.5 : 0.5) * elevation_wobble_deg) * std::numbers::pi / 180;
    const Vector3d eye = centre + 4.0 * Vector3d(std::sin(azimuth) * std::cos(elevation), -std::sin(elevation),
                                                 -std::cos(azimuth) * std::cos(elevation));
    const Vector3d front = (centre - eye).normalized(), right = Vector3d::UnitY().cross(front).normalized();
    SceneCamera c;
    c.name = "cam" + std::to_string(i);
    const double f = width * (0.95 + 0.02 * (i % 3));
    c.pinhole = {width, height, f, f, width / 2.0, height / 2.0};
    c.cam_from_world.R << right.transpose(), front.cross(right).transpose(), front.transpose();
    c.cam_from_world.t = -c.cam_from_world.R * eye;
    const double irregular = std::fmod(i * 0.6180339887, 1.0);
    c.offset_s = i == 0 ? 0 : (irregular - 0.5) * 5.0 / 30;
    c.num_frames = num_frames;
    cameras.push_back(c);
  }
  return cameras;
}

}  // namespace vantage::synthetic
