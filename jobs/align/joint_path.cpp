#include "jobs/align/joint_path.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace vantage::align {
namespace {

constexpr int kReweightings = 3;

MovingPath empty_path(const MovingPoint& point, const std::vector<JointCamera>& cameras, double knot_s) {
  double begin = std::numeric_limits<double>::infinity(), end = -begin;
  for (const MovingTrack& track : point.tracks) {
    const CameraClock& clock = cameras[track.camera].clock;
    begin = std::min(begin, clock.shot_time_s(track.times_s.front()));
    end = std::max(end, clock.shot_time_s(track.times_s.back()));
  }
  const double num_pieces = std::max(1.0, std::round((end - begin) / knot_s));
  MovingPath path{.begin_s = begin, .knot_s = (end - begin) / num_pieces, .control = {}};
  path.control.resize(static_cast<std::size_t>(num_pieces) + 3, Eigen::Vector3d::Zero());
  return path;
}

/// Normal equations of all control points' coordinates.
struct Normal {
  Eigen::MatrixXd N;
  Eigen::VectorXd rhs;
  void add(const Eigen::VectorXd& row, std::size_t first, double value, double weight) {
    const auto at = static_cast<Eigen::Index>(3 * first);
    N.block(at, at, row.size(), row.size()) += weight * row * row.transpose();
    rhs.segment(at, row.size()) += weight * value * row;
  }
};

/// The sample's two equations, over the depth that it has now (1 to begin with).
void add_sample(Normal& normal, const MovingPath& path, const JointCamera& camera, double footage_time_s,
                const Eigen::Vector2d& px, bool first_time) {
  const double time_s = camera.clock.shot_time_s(footage_time_s);
  const RigidTransform& pose = camera.cam_from_world;
  const double depth = first_time ? 1 : (pose * path.at(time_s)).z();
  const std::size_t piece = path.piece_at(time_s);
  const auto weights = spline_weights((time_s - path.piece_begin_s(piece)) / path.knot_s);
  const Eigen::Vector3d ray = camera.lens.ray(px);
  for (int axis = 0; axis < 2; ++axis) {
    const double scale = (axis == 0 ? camera.lens.fx : camera.lens.fy) / depth;
    const Eigen::Vector3d line = scale * (pose.R.row(axis) - ray[axis] * pose.R.row(2)).transpose();
    Eigen::VectorXd row(12);
    for (int k = 0; k < 4; ++k) row.segment<3>(3 * k) = weights[static_cast<std::size_t>(k)] * line;
    normal.add(row, piece, scale * (ray[axis] * pose.t.z() - pose.t[axis]), 1);
  }
}

void add_bends(Normal& normal, const MovingPath& path, double std) {
  for (std::size_t k = 0; k + 2 < path.control.size(); ++k)
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::VectorXd row = Eigen::VectorXd::Zero(9);
      row[axis] = row[6 + axis] = 1;
      row[3 + axis] = -2;
      normal.add(row, k, 0, 1 / (std * std));
    }
}

/// World length of a pixel, at the path's middle; nothing when that is behind a camera.
std::optional<double> pixel_at(const MovingPath& path, const MovingPoint& point,
                               const std::vector<JointCamera>& cameras) {
  double sum = 0;
  for (const MovingTrack& track : point.tracks) {
    const JointCamera& camera = cameras[track.camera];
    const double time_s = camera.clock.shot_time_s(track.times_s[track.times_s.size() / 2]);
    const double depth = (camera.cam_from_world * path.at(time_s)).z();
    if (!(depth > 0)) return std::nullopt;
    sum += depth / camera.lens.fx;
  }
  return sum / static_cast<double>(point.tracks.size());
}

}  // namespace

std::size_t MovingPath::piece_at(double time_s) const {
  const auto last = static_cast<double>(control.size() - 4);
  return static_cast<std::size_t>(std::clamp(std::floor((time_s - begin_s) / knot_s), 0.0, last));
}

Eigen::Vector3d MovingPath::at(double time_s) const {
  const std::size_t piece = piece_at(time_s);
  const auto weights = spline_weights((time_s - piece_begin_s(piece)) / knot_s);
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) out += weights[k] * control[piece + k];
  return out;
}

std::optional<MovingPath> fit_path(const MovingPoint& point, const std::vector<JointCamera>& cameras, double knot_s) {
  MovingPath path = empty_path(point, cameras, knot_s);
  if (!(path.knot_s > 0)) return std::nullopt;
  const auto size = static_cast<Eigen::Index>(3 * path.control.size());
  for (int round = 0; round < kReweightings; ++round) {
    Normal normal{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
    for (const MovingTrack& track : point.tracks)
      for (std::size_t k = 0; k < track.px.size(); ++k)
        add_sample(normal, path, cameras[track.camera], track.times_s[k], track.px[k], round == 0);
    add_bends(normal, path, round == 0 ? kBendPx : kBendPx * path.unit);
    const Eigen::VectorXd solved = normal.N.ldlt().solve(normal.rhs);
    for (std::size_t k = 0; k < path.control.size(); ++k)
      path.control[k] = solved.segment<3>(static_cast<Eigen::Index>(3 * k));
    const auto unit = pixel_at(path, point, cameras);
    if (!unit || !solved.allFinite()) return std::nullopt;
    path.unit = *unit;
  }
  return path;
}

}  // namespace vantage::align
