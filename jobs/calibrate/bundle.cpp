#include "jobs/calibrate/bundle.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "jobs/vision/undistort.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

/// All lens models as one block: f, fy/fx, cx, cy, k1, k2, p1, p2.
enum LensTerm { kF, kAspect, kCx, kCy, kK1, kK2, kP1, kP2, kNumLensTerms };
using LensBlock = std::array<double, kNumLensTerms>;
using PoseBlock = std::array<double, 6>;  ///< angle-axis, translation: cam from world

LensBlock block_of(const LensModel& lens) {
  const auto& p = lens.params;
  if (lens.model == "OPENCV") return {p[0], p[1] / p[0], p[2], p[3], p[4], p[5], p[6], p[7]};
  if (lens.model == "PINHOLE") return {p[0], p[1] / p[0], p[2], p[3], 0, 0, 0, 0};
  return {p[0], 1, p[1], p[2], p.size() > 3 ? p[3] : 0, p.size() > 4 ? p[4] : 0, 0, 0};
}

void store(const LensBlock& b, LensModel& lens) {
  const std::vector<double> one_focal{b[kF], b[kCx], b[kCy], b[kK1], b[kK2]};
  if (lens.model == "OPENCV")
    lens.params = {b[kF], b[kF] * b[kAspect], b[kCx], b[kCy], b[kK1], b[kK2], b[kP1], b[kP2]};
  else if (lens.model == "PINHOLE")
    lens.params = {b[kF], b[kF] * b[kAspect], b[kCx], b[kCy]};
  else
    lens.params.assign(one_focal.begin(), one_focal.begin() + static_cast<std::ptrdiff_t>(lens.params.size()));
}

std::vector<int> fixed_terms(const std::string& model) {
  if (model == "OPENCV") return {kCx, kCy};
  if (model == "PINHOLE") return {kCx, kCy, kK1, kK2, kP1, kP2};
  if (model == "RADIAL") return {kAspect, kCx, kCy, kP1, kP2};
  if (model == "SIMPLE_RADIAL") return {kAspect, kCx, kCy, kK2, kP1, kP2};
  check(model == "SIMPLE_PINHOLE", "only models that COLMAP was asked for are refined: " + model);
  return {kAspect, kCx, kCy, kK1, kK2, kP1, kP2};
}

PoseBlock block_of(const RigidTransform& pose) {
  PoseBlock out{};
  const Eigen::AngleAxisd turn(pose.R);
  Eigen::Map<Eigen::Vector3d>(out.data()) = turn.angle() * turn.axis();
  Eigen::Map<Eigen::Vector3d>(out.data() + 3) = pose.t;
  return out;
}

RigidTransform pose_of(const PoseBlock& block) {
  RigidTransform out;
  const Eigen::Vector3d turn = Eigen::Map<const Eigen::Vector3d>(block.data());
  if (turn.norm() > 0) out.R = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  out.t = Eigen::Map<const Eigen::Vector3d>(block.data() + 3);
  return out;
}

/// Distance in px between a measured and a projected point. Same formula as distort(), which a test holds against it.
struct Reprojection {
  Eigen::Vector2d px;
  template <class T>
  bool operator()(const T* lens, const T* pose, const T* point, T* residual) const {
    T in_cam[3];
    ceres::AngleAxisRotatePoint(pose, point, in_cam);
    for (int i = 0; i < 3; ++i) in_cam[i] += pose[3 + i];
    const T x = in_cam[0] / in_cam[2], y = in_cam[1] / in_cam[2], r2 = x * x + y * y;
    const T radial = 1.0 + r2 * (lens[kK1] + r2 * lens[kK2]);
    const T u = x * radial + 2.0 * lens[kP1] * x * y + lens[kP2] * (r2 + 2.0 * x * x);
    const T v = y * radial + 2.0 * lens[kP2] * x * y + lens[kP1] * (r2 + 2.0 * y * y);
    residual[0] = lens[kF] * u + lens[kCx] - px.x();
    residual[1] = lens[kF] * lens[kAspect] * v + lens[kCy] - px.y();
    return true;
  }
};

/// Pictures do not tell the world's place, turn and size: the first image's pose stays, and of the image farthest from
/// it the coordinate along which it is farthest.
void hold_the_world(const SparseModel& model, std::map<ImageId, PoseBlock>& poses, ceres::Problem& problem) {
  PoseBlock& first = poses.begin()->second;
  const Eigen::Vector3d from = pose_of(first).centre();
  ImageId farthest = poses.begin()->first;
  double distance = 0;
  for (const auto& [image, pose] : model.cam_from_world)
    if (const double d = (pose.centre() - from).norm();
        d > distance && problem.HasParameterBlock(poses.at(image).data())) {
      distance = d;
      farthest = image;
    }
  if (problem.HasParameterBlock(first.data())) problem.SetParameterBlockConstant(first.data());
  if (!(distance > 0)) return;
  const RigidTransform& pose = model.cam_from_world.at(farthest);
  int axis = 0;
  (pose.R * (pose.centre() - from)).cwiseAbs().maxCoeff(&axis);
  problem.SetManifold(poses.at(farthest).data(), new ceres::SubsetManifold(6, {3 + axis}));
}

/// One round: all observations of the model, in its order, so that the same model gives the same result.
void solve(SparseModel& model) {
  std::map<std::string, LensBlock> lenses;
  std::map<ImageId, PoseBlock> poses;
  for (const auto& [name, lens] : model.lenses) lenses[name] = block_of(lens);
  for (const auto& [image, pose] : model.cam_from_world) poses[image] = block_of(pose);
  ceres::Problem problem;
  for (const auto& o : model.observations)
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<Reprojection, 2, kNumLensTerms, 6, 3>(new Reprojection{o.px}),
        new ceres::SoftLOneLoss(1.0), lenses.at(o.image.camera).data(), poses.at(o.image).data(),
        model.points[static_cast<std::size_t>(o.point)].position.data());
  auto* order = new ceres::ParameterBlockOrdering;
  for (auto& point : model.points)
    if (problem.HasParameterBlock(point.position.data())) order->AddElementToGroup(point.position.data(), 0);
  for (auto& [name, block] : lenses) {
    if (!problem.HasParameterBlock(block.data())) continue;
    problem.SetManifold(block.data(),
                        new ceres::SubsetManifold(kNumLensTerms, fixed_terms(model.lenses.at(name).model)));
    order->AddElementToGroup(block.data(), 1);
  }
  for (auto& [image, block] : poses)
    if (problem.HasParameterBlock(block.data())) order->AddElementToGroup(block.data(), 1);
  hold_the_world(model, poses, problem);
  ceres::Solver::Options options;
  options.linear_solver_type = poses.size() < 80 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  options.linear_solver_ordering.reset(order);
  options.max_num_iterations = 60;
  options.function_tolerance = 1e-8;
  options.num_threads = 1;  // sums in one order
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return;
  for (auto& [name, lens] : model.lenses) store(lenses.at(name), lens);
  for (auto& [image, pose] : model.cam_from_world) pose = pose_of(poses.at(image));
}

/// Infinite behind the camera.
double error_px(const SparseModel& model, const SparseModel::Observation& o) {
  const Eigen::Vector3d p = model.cam_from_world.at(o.image) * model.points[static_cast<std::size_t>(o.point)].position;
  if (!(p.z() > 0)) return std::numeric_limits<double>::infinity();
  const cv::Point2d px = distort(model.lenses.at(o.image.camera), {p.x() / p.z(), p.y() / p.z()});
  return std::hypot(px.x - o.px.x(), px.y - o.px.y());
}

/// Number of observations dropped.
int drop_outliers(SparseModel& model, double max_error_px) {
  const auto before = model.observations.size();
  std::erase_if(model.observations, [&](const auto& o) { return error_px(model, o) > max_error_px; });
  std::vector<int> times_seen(model.points.size());
  for (const auto& o : model.observations) ++times_seen[static_cast<std::size_t>(o.point)];
  std::erase_if(model.observations, [&](const auto& o) { return times_seen[static_cast<std::size_t>(o.point)] < 2; });
  return static_cast<int>(before - model.observations.size());
}

/// Points that nothing sees any more go; indices follow.
void drop_unseen_points(SparseModel& model) {
  std::vector<int> new_index(model.points.size(), -1);
  for (const auto& o : model.observations) new_index[static_cast<std::size_t>(o.point)] = 0;
  std::vector<SparseModel::Point> kept;
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    if (new_index[i] < 0) continue;
    new_index[i] = static_cast<int>(kept.size());
    kept.push_back(model.points[i]);
  }
  for (auto& o : model.observations) o.point = new_index[static_cast<std::size_t>(o.point)];
  model.points = std::move(kept);
}

BundleReport report_of(const SparseModel& model, int num_dropped) {
  BundleReport out{.num_observations = static_cast<int>(model.observations.size()), .num_dropped = num_dropped};
  for (const auto& o : model.observations) {
    const double e = error_px(model, o);
    out.mean_px += e;
    out.rms_px += e * e;
  }
  const double n = std::max(1, out.num_observations);
  out.mean_px /= n;
  out.rms_px = std::sqrt(out.rms_px / n);
  return out;
}

/// Farthest that the lens moves a pixel of the picture's rim from where a pinhole would have it.
double largest_shift_px(const LensModel& lens) {
  LensBlock b = block_of(lens);
  double largest = 0;
  for (int i = 0; i <= 16; ++i)
    for (const auto& [x, y] :
         {std::pair(i / 16.0, 0.0), std::pair(i / 16.0, 1.0), std::pair(0.0, i / 16.0), std::pair(1.0, i / 16.0)}) {
      const cv::Point2d px(x * lens.width, y * lens.height);
      const cv::Point2d seen = distort(lens, {(px.x - b[kCx]) / b[kF], (px.y - b[kCy]) / (b[kF] * b[kAspect])});
      largest = std::max(largest, std::hypot(seen.x - px.x, seen.y - px.y));
    }
  return largest;
}

}  // namespace

BundleReport refine_bundle(SparseModel& model, double max_error_px) {
  solve(model);
  const int num_dropped = drop_outliers(model, max_error_px);
  drop_unseen_points(model);
  solve(model);
  return report_of(model, num_dropped);
}

BundleReport drop_idle_lenses(SparseModel& model, double max_error_px, const BundleReport& before) {
  SparseModel simpler = model;
  bool any = false;
  for (auto& [name, lens] : simpler.lenses) {
    if (lens.model.find("PINHOLE") != std::string::npos || largest_shift_px(lens) > 1) continue;
    const LensBlock b = block_of(lens);
    if (lens.model == "OPENCV")
      lens = {"PINHOLE", lens.width, lens.height, {b[kF], b[kF] * b[kAspect], b[kCx], b[kCy]}};
    else
      lens = {"SIMPLE_PINHOLE", lens.width, lens.height, {b[kF], b[kCx], b[kCy]}};
    any = true;
  }
  if (!any) return before;
  const BundleReport after = refine_bundle(simpler, max_error_px);
  if (after.rms_px > 1.02 * before.rms_px) return before;
  model = std::move(simpler);
  return after;
}

}  // namespace vantage
