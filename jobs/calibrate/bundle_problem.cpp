#include "jobs/calibrate/bundle_problem.h"

#include <ceres/rotation.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "schema/base/error.h"

namespace vantage {
namespace {

// A cheap camera's principal point lies within about 2 % of the longer side of the picture's centre.
constexpr double kCentreSpread = 0.02;

std::vector<int> fixed_terms(const std::string& model, bool free_centre) {
  std::vector<int> out;
  if (model == "PINHOLE") out = {kK1, kK2, kP1, kP2};
  if (model == "RADIAL") out = {kAspect, kP1, kP2};
  if (model == "SIMPLE_RADIAL") out = {kAspect, kK2, kP1, kP2};
  if (model == "SIMPLE_PINHOLE") out = {kAspect, kK1, kK2, kP1, kP2};
  check(!out.empty() || model == "OPENCV", "only models that COLMAP was asked for are refined: " + model);
  if (!free_centre) out.insert(out.end(), {kCx, kCy});
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

/// A principal point's distance from the picture's centre, in px of measurement noise.
struct CentrePrior {
  Eigen::Vector2d centre;
  double weight;
  template <class T>
  bool operator()(const T* lens, T* residual) const {
    residual[0] = weight * (lens[kCx] - centre.x());
    residual[1] = weight * (lens[kCy] - centre.y());
    return true;
  }
};

}  // namespace

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

BundleProblem::BundleProblem(SparseModel& model, const LensFreedom& freedom, double noise_px)
    : model_(model), freedom_(freedom) {
  lens_blocks_.reserve(model.lenses.size());
  for (const auto& [name, lens] : model.lenses)
    if (const auto [entry, fresh] = lenses_.try_emplace(freedom.shared ? "" : name, nullptr); fresh)
      entry->second = &lens_blocks_.emplace_back(block_of(lens));
  pose_blocks_.reserve(model.cam_from_world.size());
  for (const auto& [image, pose] : model.cam_from_world) poses_[image] = &pose_blocks_.emplace_back(block_of(pose));
  add_measurements(noise_px);
  set_lens_freedom(noise_px);
}

/// All observations of the model, in its order, so that the same model gives the same result.
void BundleProblem::add_measurements(double noise_px) {
  for (const auto& o : model_.observations)
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<Reprojection, 2, kNumLensTerms, 6, 3>(new Reprojection{o.px}),
        new ceres::CauchyLoss(2 * noise_px), lens_of(o.image.camera).data(), poses_.at(o.image)->data(),
        model_.points[static_cast<std::size_t>(o.point)].position.data());
}

void BundleProblem::set_lens_freedom(double noise_px) {
  for (const auto& [name, lens] : model_.lenses) {
    LensBlock& block = lens_of(name);
    if (!problem_.HasParameterBlock(block.data()) || problem_.GetManifold(block.data()) != nullptr) continue;
    problem_.SetManifold(block.data(),
                         new ceres::SubsetManifold(kNumLensTerms, fixed_terms(lens.model, freedom_.centre)));
    if (!freedom_.centre) continue;
    const double spread_px = kCentreSpread * std::max(lens.width, lens.height);
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<CentrePrior, 2, kNumLensTerms>(
                                  new CentrePrior{{lens.width / 2.0, lens.height / 2.0}, noise_px / spread_px}),
                              nullptr, block.data());
  }
}

void BundleProblem::hold_the_world() {
  PoseBlock& first = *poses_.begin()->second;
  const Eigen::Vector3d from = model_.cam_from_world.begin()->second.centre();
  ImageId farthest;
  double distance = 0;
  for (const auto& [image, pose] : model_.cam_from_world)
    if (const double d = (pose.centre() - from).norm();
        d > distance && problem_.HasParameterBlock(poses_.at(image)->data())) {
      distance = d;
      farthest = image;
    }
  if (problem_.HasParameterBlock(first.data())) problem_.SetParameterBlockConstant(first.data());
  if (!(distance > 0)) return;
  const RigidTransform& pose = model_.cam_from_world.at(farthest);
  int axis = 0;
  (pose.R * (pose.centre() - from)).cwiseAbs().maxCoeff(&axis);
  problem_.SetManifold(poses_.at(farthest)->data(), new ceres::SubsetManifold(6, {3 + axis}));
}

bool BundleProblem::solve() {
  auto* order = new ceres::ParameterBlockOrdering;
  for (auto& point : model_.points)
    if (problem_.HasParameterBlock(point.position.data())) order->AddElementToGroup(point.position.data(), 0);
  for (auto& block : lens_blocks_)
    if (problem_.HasParameterBlock(block.data())) order->AddElementToGroup(block.data(), 1);
  for (auto& block : pose_blocks_)
    if (problem_.HasParameterBlock(block.data())) order->AddElementToGroup(block.data(), 2);
  ceres::Solver::Options options;
  options.linear_solver_type = poses_.size() < 80 ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
  options.linear_solver_ordering.reset(order);
  options.max_num_iterations = 60;
  options.function_tolerance = 1e-8;
  options.num_threads = 1;  // sums in one order
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem_, &summary);
  if (!summary.IsSolutionUsable()) return false;
  for (auto& [name, lens] : model_.lenses) store(lens_of(name), lens);
  for (auto& [image, pose] : model_.cam_from_world) pose = pose_of(*poses_.at(image));
  return true;
}

}  // namespace vantage
