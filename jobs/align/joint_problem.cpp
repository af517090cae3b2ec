#include "jobs/align/joint_problem.h"

#include <ceres/ceres.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "jobs/align/joint_residuals.h"

namespace vantage::align {
namespace {

constexpr double kCauchyScale = 2;
constexpr double kClockStdFrames = 10;
constexpr double kCrystalStd = 50e-6;
/// A rate that pairs measured, against all crystals' wont, comes from the same tracks: it must not count twice.
constexpr double kRateSlack = 3;

ceres::LossFunction* loss() { return new ceres::CauchyLoss(kCauchyScale); }

JointState::Camera blocks_of(const JointCamera& camera) {
  JointState::Camera out{{camera.clock.shot_time_s(camera.middle_s), camera.clock.rate}, {}, camera.lens.fx};
  const Eigen::AngleAxisd turn(camera.cam_from_world.R);
  Eigen::Map<Eigen::Vector3d>(out.pose.data()) = turn.angle() * turn.axis();
  Eigen::Map<Eigen::Vector3d>(out.pose.data() + 3) = camera.cam_from_world.t;
  return out;
}

/// Adds a scene's points to a problem over a state's blocks.
class Builder {
 public:
  Builder(const JointScene& scene, JointState& state, const JointNoise& noise)
      : scene_(scene), state_(state), noise_(noise) {
    out_.problem = std::make_unique<ceres::Problem>();
  }

  void add_moving(std::size_t point) {
    auto& blocks = out_.moving.emplace_back();
    const auto& tracks = scene_.moving[point].tracks;
    for (std::size_t t = 0; t < tracks.size(); ++t) {
      auto& bias = state_.biases[point][t];
      for (std::size_t k = 0; k < tracks[t].px.size(); ++k) add_sample(blocks, point, tracks[t], k, bias.data());
      const double std = noise_.bias_px;
      blocks.push_back(out_.problem->AddResidualBlock(
          new ceres::AutoDiffCostFunction<PriorResidual<2>, 2, 2>(new PriorResidual<2>{{0, 0}, {std, std}}), loss(),
          bias.data()));
    }
    MovingPath& path = state_.paths[point];
    for (std::size_t k = 0; k + 2 < path.control.size(); ++k)
      blocks.push_back(out_.problem->AddResidualBlock(
          new ceres::AutoDiffCostFunction<BendResidual, 3, 3, 3, 3>(new BendResidual{kBendPx * path.unit}), nullptr,
          path.control[k].data(), path.control[k + 1].data(), path.control[k + 2].data()));
  }

  void add_still(std::size_t point) {
    auto& blocks = out_.still.emplace_back();
    for (const auto& sight : scene_.still[point].seen) {
      auto& camera = state_.cameras[sight.camera];
      blocks.push_back(
          out_.problem->AddResidualBlock(new ceres::AutoDiffCostFunction<StillResidual, 2, 6, 1, 3>(new StillResidual{
                                             scene_.cameras[sight.camera].lens, sight.px, noise_.still_px}),
                                         loss(), camera.pose.data(), &camera.focal, state_.still[point].data()));
    }
  }

  void add_clock_prior(std::size_t i) {
    const JointCamera& camera = scene_.cameras[i];
    const auto start = blocks_of(camera);
    const bool by_pairs = camera.clock.rate_std > kCrystalStd;
    const double rate_std = by_pairs ? kRateSlack * camera.clock.rate_std : kCrystalStd;
    out_.priors.push_back(
        out_.problem->AddResidualBlock(new ceres::AutoDiffCostFunction<PriorResidual<2>, 2, 2>(new PriorResidual<2>{
                                           start.clock, {kClockStdFrames * camera.frame_s, rate_std}}),
                                       nullptr, state_.cameras[i].clock.data()));
  }

  void hold(bool clocks, bool poses) {
    for (std::size_t i = 0; i < state_.cameras.size(); ++i) {
      auto& camera = state_.cameras[i];
      if (clocks || i == 0) hold_block(camera.clock.data());
      if (poses) hold_block(camera.pose.data());
      if (poses) hold_block(&camera.focal);
    }
    if (!poses) hold_the_world();
  }

  JointProblem take() { return std::move(out_); }

 private:
  void add_sample(std::vector<ceres::ResidualBlockId>& blocks, std::size_t point, const MovingTrack& track,
                  std::size_t k, double* bias) {
    auto& camera = state_.cameras[track.camera];
    MovingPath& path = state_.paths[point];
    const double since_middle_s = track.times_s[k] - scene_.cameras[track.camera].middle_s;
    const std::size_t piece = path.piece_at(camera.clock[0] + camera.clock[1] * since_middle_s);
    auto* residual = new MovingResidual{scene_.cameras[track.camera].lens,
                                        since_middle_s,
                                        path.piece_begin_s(piece),
                                        path.knot_s,
                                        track.px[k],
                                        noise_.sample_px};
    blocks.push_back(out_.problem->AddResidualBlock(
        new ceres::AutoDiffCostFunction<MovingResidual, 2, 2, 6, 1, 3, 3, 3, 3, 2>(residual), loss(),
        camera.clock.data(), camera.pose.data(), &camera.focal, path.control[piece].data(),
        path.control[piece + 1].data(), path.control[piece + 2].data(), path.control[piece + 3].data(), bias));
  }

  void hold_block(double* block) {
    if (out_.problem->HasParameterBlock(block)) out_.problem->SetParameterBlockConstant(block);
  }

  void hold_the_world() {
    hold_block(state_.cameras[0].pose.data());
    const Eigen::Vector3d from = scene_.cameras[0].cam_from_world.centre();
    const auto away = [&](const JointCamera& c) -> Eigen::Vector3d { return c.cam_from_world.centre() - from; };
    const auto far = std::max_element(scene_.cameras.begin(), scene_.cameras.end(),
                                      [&](const auto& a, const auto& b) { return away(a).norm() < away(b).norm(); });
    int axis = 0;
    (far->cam_from_world.R * away(*far)).cwiseAbs().maxCoeff(&axis);
    double* pose = state_.cameras[static_cast<std::size_t>(far - scene_.cameras.begin())].pose.data();
    if (out_.problem->HasParameterBlock(pose))
      out_.problem->SetManifold(pose, new ceres::SubsetManifold(6, {3 + axis}));
  }

  const JointScene& scene_;
  JointState& state_;
  JointNoise noise_;
  JointProblem out_;
};

}  // namespace

JointState start_state(const JointScene& scene, std::vector<MovingPath> paths) {
  JointState state;
  for (const auto& camera : scene.cameras) state.cameras.push_back(blocks_of(camera));
  for (const auto& point : scene.moving) state.biases.emplace_back(point.tracks.size(), Eigen::Vector2d::Zero());
  for (const auto& point : scene.still) state.still.push_back(point.position);
  state.paths = std::move(paths);
  return state;
}

JointCamera camera_of(const JointScene& scene, const JointState& state, std::size_t i) {
  JointCamera out = scene.cameras[i];
  const auto& blocks = state.cameras[i];
  out.clock.rate = blocks.clock[1];
  out.clock.offset_s = blocks.clock[0] - blocks.clock[1] * out.middle_s;
  const Eigen::Vector3d turn = Eigen::Map<const Eigen::Vector3d>(blocks.pose.data());
  out.cam_from_world.R = Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix();
  out.cam_from_world.t = Eigen::Map<const Eigen::Vector3d>(blocks.pose.data() + 3);
  out.lens.fy *= blocks.focal / out.lens.fx;
  out.lens.fx = blocks.focal;
  return out;
}

std::vector<Eigen::Vector2d> errors_px(const JointScene& scene, const JointState& state, std::size_t moving) {
  std::vector<Eigen::Vector2d> out;
  const auto& tracks = scene.moving[moving].tracks;
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    const JointCamera camera = camera_of(scene, state, tracks[t].camera);
    for (std::size_t k = 0; k < tracks[t].px.size(); ++k) {
      const Eigen::Vector3d point = state.paths[moving].at(camera.clock.shot_time_s(tracks[t].times_s[k]));
      out.push_back(camera.lens.project(camera.cam_from_world * point) + state.biases[moving][t] - tracks[t].px[k]);
    }
  }
  return out;
}

JointProblem build_problem(const JointScene& scene, JointState& state, const JointNoise& noise, bool hold_cameras) {
  Builder builder(scene, state, noise);
  for (std::size_t i = 0; i < scene.moving.size(); ++i) builder.add_moving(i);
  // Points of the background say nothing when no pose may move.
  for (std::size_t i = 0; i < scene.still.size() && !scene.known_cameras; ++i) builder.add_still(i);
  for (std::size_t i = 1; i < scene.cameras.size() && !hold_cameras; ++i) builder.add_clock_prior(i);
  builder.hold(hold_cameras, hold_cameras || scene.known_cameras);
  return builder.take();
}

}  // namespace vantage::align
