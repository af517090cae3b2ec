#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "jobs/align/joint_scene.h"

namespace vantage::align {

/// The four weights of a uniform cubic B-spline's piece at u in [0, 1] (beyond: the piece goes on).
template <class T>
std::array<T, 4> spline_weights(const T& u) {
  const T v = 1.0 - u, u2 = u * u, u3 = u2 * u;
  return {v * v * v / 6.0, (3.0 * u3 - 6.0 * u2 + 4.0) / 6.0, (-3.0 * u3 + 3.0 * u2 + 3.0 * u + 1.0) / 6.0, u3 / 6.0};
}

/// A moving point's way through the world: a uniform cubic B-spline over shot time.
struct MovingPath {
  double begin_s = 0, knot_s = 1;
  std::vector<Eigen::Vector3d> control;  ///< pieces + 3
  double unit = 1;                       ///< world length that is a pixel there

  std::size_t piece_at(double time_s) const;
  double piece_begin_s(std::size_t piece) const { return begin_s + knot_s * static_cast<double>(piece); }
  Eigen::Vector3d at(double time_s) const;
};

/// Differences of second order between control points are taken to be about this many pixels: far more than what
/// things do between knots, so that it matters only where samples are missing.
constexpr double kBendPx = 20;

/// Linear least squares (DLT, Hartley & Zisserman 2003, §12.2, with the point's place at each sample's time a sum of
/// four control points). knot_s: about the time between knots. Empty when the path comes to lie behind a camera.
std::optional<MovingPath> fit_path(const MovingPoint& point, const std::vector<JointCamera>& cameras, double knot_s);

}  // namespace vantage::align
