#include "jobs/align/joint_adjustment.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "jobs/align/joint_information.h"

namespace vantage::align {
namespace {

constexpr double kFramesPerKnot = 3.5;
constexpr int kRounds = 3;
constexpr int kMaxIterations = 25;
constexpr int kMinPoints = 5;
/// A point is left out when half of its samples are farther off: before clocks and poses moved, and after.
constexpr double kMaxStartPx = 4, kMaxDeviations = 4;
constexpr double kMaxBiasDeviations = 5;
constexpr double kMinNoisePx = 0.1;
constexpr double kMaxClockDeviations = 3;
/// What pairs may be off by together, whatever their standard deviations say.
constexpr double kClockFloorFrames = 0.02;
/// Tracks that begin nearer than this to each other may err together.
constexpr double kClusterPx = 40, kClusterS = 0.5;

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// A scene being adjusted, with the points that still take part.
struct Work {
  JointScene scene;
  JointState state;
  JointNoise noise;
};

double slowest_frame_s(const JointScene& scene) {
  double slowest = 0;
  for (const auto& camera : scene.cameras) slowest = std::max(slowest, camera.frame_s);
  return slowest;
}

Work begin(const JointScene& scene) {
  Work work{.scene = scene, .state = {}, .noise = {}};
  work.scene.moving.clear();
  std::vector<MovingPath> paths;
  for (const MovingPoint& point : scene.moving)
    if (auto path = fit_path(point, scene.cameras, kFramesPerKnot * slowest_frame_s(scene))) {
      work.scene.moving.push_back(point);
      paths.push_back(std::move(*path));
    }
  work.state = start_state(work.scene, std::move(paths));
  return work;
}

std::vector<double> distances_px(const Work& work, std::size_t point) {
  std::vector<double> out;
  for (const auto& error : errors_px(work.scene, work.state, point)) out.push_back(error.norm());
  return out;
}

double largest_bias_px(const Work& work, std::size_t point) {
  double largest = 0;
  for (const auto& bias : work.state.biases[point]) largest = std::max(largest, bias.norm());
  return largest;
}

void leave_out_points(Work& work, double max_error_px, double max_bias_px) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < work.scene.moving.size(); ++i) {
    if (median(distances_px(work, i)) > max_error_px || largest_bias_px(work, i) > max_bias_px) continue;
    std::swap(work.scene.moving[kept], work.scene.moving[i]);
    std::swap(work.state.paths[kept], work.state.paths[i]);
    std::swap(work.state.biases[kept], work.state.biases[i]);
    ++kept;
  }
  work.scene.moving.resize(kept);
  work.state.paths.resize(kept);
  work.state.biases.resize(kept);
}

/// From medians. A path's own unknowns take up part of the samples' noise. Of the biases of V views all but 2V - 3
/// directions pass for another place of the point.
void estimate_noise(Work& work) {
  std::vector<double> deviations, biases, still;
  double num_numbers = 0, num_unknowns = 0;
  for (std::size_t i = 0; i < work.scene.moving.size(); ++i) {
    for (const auto& e : errors_px(work.scene, work.state, i))
      deviations.insert(deviations.end(), {std::abs(e.x()), std::abs(e.y())});
    double squares = 0;
    for (const auto& bias : work.state.biases[i]) squares += bias.squaredNorm();
    const double freedom = 2 * static_cast<double>(work.state.biases[i].size()) - 3;
    biases.push_back(squares / (freedom * std::pow(1 - 2 / (9 * freedom), 3)));  // by the median of chi squared
    num_unknowns += 3 * static_cast<double>(work.state.paths[i].control.size()) + freedom;
  }
  num_numbers = static_cast<double>(deviations.size());
  const double share = std::max(0.25, 1 - num_unknowns / std::max(1.0, num_numbers));
  work.noise.sample_px = std::clamp(1.4826 * median(std::move(deviations)) / std::sqrt(share), kMinNoisePx, 2.0);
  work.noise.bias_px = std::clamp(std::sqrt(median(std::move(biases))), kMinNoisePx, 4.0);
  for (std::size_t i = 0; i < work.scene.still.size(); ++i)
    for (const auto& sight : work.scene.still[i].seen) {
      const JointCamera camera = camera_of(work.scene, work.state, sight.camera);
      const Eigen::Vector2d e = camera.lens.project(camera.cam_from_world * work.state.still[i]) - sight.px;
      still.insert(still.end(), {std::abs(e.x()), std::abs(e.y())});
    }
  work.noise.still_px = std::clamp(1.4826 * median(std::move(still)), kMinNoisePx, 2.0);
}

ceres::Solver::Summary solve(ceres::Problem& problem) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = kMaxIterations;
  options.function_tolerance = 1e-7;
  options.num_threads = 1;  // sums in one order
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return summary;
}

/// Half of the samples are nearer to where they should be. (Wrong samples make a mean square say nothing.)
double error_px(const Work& work) {
  std::vector<double> all;
  for (std::size_t i = 0; i < work.scene.moving.size(); ++i)
    for (const double d : distances_px(work, i)) all.push_back(d);
  return median(std::move(all));
}

/// Which points may err together: those whose first tracks pass through one cell of a picture and of time.
std::vector<long> clusters_of(const JointScene& scene) {
  std::map<std::array<long, 4>, long> known;
  std::vector<long> out;
  for (const MovingPoint& point : scene.moving) {
    const MovingTrack& track = point.tracks.front();
    const std::size_t middle = track.px.size() / 2;
    const std::array<long, 4> cell{static_cast<long>(track.camera), std::lround(track.px[middle].x() / kClusterPx),
                                   std::lround(track.px[middle].y() / kClusterPx),
                                   std::lround(track.times_s[middle] / kClusterS)};
    out.push_back(known.emplace(cell, std::ssize(known)).first->second);
  }
  return out;
}

void store_covariance(Work& work, JointResult& result) {
  const JointProblem problem = build_problem(work.scene, work.state, work.noise, false);
  const auto posterior = covariance_of_cameras(problem, work.state, clusters_of(work.scene));
  for (std::size_t i = 0; i < result.cameras.size(); ++i) {
    CameraClock& clock = result.cameras[i].clock;
    const auto column = posterior.column.find(work.state.cameras[i].clock.data());
    const bool held = column == posterior.column.end();
    clock.offset_std_s = held ? 0 : std::sqrt(posterior.covariance(column->second, column->second));
    clock.rate_std = held ? 0 : std::sqrt(posterior.covariance(column->second + 1, column->second + 1));
  }
}

/// The points that were left, in the cameras as they were given.
void score_start(const Work& end, const JointScene& scene, JointResult& result) {
  Work start = end;
  start.state.cameras = start_state(scene, {}).cameras;
  for (std::size_t i = 0; i < start.scene.still.size(); ++i) start.state.still[i] = start.scene.still[i].position;
  JointProblem problem = build_problem(start.scene, start.state, start.noise, true);
  result.cost_before = solve(*problem.problem).final_cost;
  result.error_before_px = error_px(start);
}

/// Clock of the result that left its start by too much; empty when none did.
std::string strayed_clock(const JointScene& scene, JointResult& result) {
  std::string strayed;
  for (std::size_t i = 1; i < scene.cameras.size(); ++i) {
    const JointCamera &was = scene.cameras[i], &is = result.cameras[i];
    const double change = std::abs(is.clock.shot_time_s(is.middle_s) - was.clock.shot_time_s(was.middle_s));
    result.largest_change_s = std::max(result.largest_change_s, change);
    const double std = std::hypot(was.clock.offset_std_s, is.clock.offset_std_s, kClockFloorFrames * is.frame_s);
    if (change > kMaxClockDeviations * std && strayed.empty())
      strayed =
          fmt::format("the clock of {} would move by {:.1f} ms, {:.1f} standard deviations from what its pairs say",
                      is.clock.name, 1e3 * change, change / std);
  }
  return strayed;
}

JointResult not_done(const JointScene& scene, const std::string& why) {
  JointResult result{.cameras = scene.cameras, .noise = {}, .verdict = "not adjusted jointly: " + why};
  return result;
}

}  // namespace

JointResult adjust_jointly(const JointScene& scene) {
  Work work = begin(scene);
  JointProblem held = build_problem(work.scene, work.state, work.noise, true);
  solve(*held.problem);
  leave_out_points(work, kMaxStartPx, 4 * kMaxStartPx);
  bool usable = true;
  double cost_after = 0;
  for (int round = 0; round < kRounds && usable; ++round) {
    if (std::ssize(work.scene.moving) < kMinPoints)
      return not_done(scene, fmt::format("{} moving points fit their cameras, expected {} or more",
                                         work.scene.moving.size(), kMinPoints));
    estimate_noise(work);
    if (round > 0)
      leave_out_points(work, kMaxDeviations * work.noise.sample_px, kMaxBiasDeviations * work.noise.bias_px);
    JointProblem problem = build_problem(work.scene, work.state, work.noise, false);
    const auto summary = solve(*problem.problem);
    usable = summary.IsSolutionUsable();
    cost_after = summary.final_cost;
  }
  if (!usable) return not_done(scene, "the adjustment does not converge");

  JointResult result{.cameras = {}, .noise = work.noise, .verdict = {}};
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) result.cameras.push_back(camera_of(scene, work.state, i));
  store_covariance(work, result);
  score_start(work, scene, result);
  result.num_moving = static_cast<int>(work.scene.moving.size());
  result.num_still = scene.known_cameras ? 0 : static_cast<int>(scene.still.size());
  result.cost_after = cost_after;
  result.error_after_px = error_px(work);
  const std::string strayed = strayed_clock(scene, result);
  result.accepted = strayed.empty() && result.cost_after < result.cost_before;
  result.verdict = result.accepted
                       ? fmt::format("{} moving points and {} still ones adjusted jointly, clocks by up to {:.1f} ms",
                                     result.num_moving, result.num_still, 1e3 * result.largest_change_s)
                       : "the pairs' clocks stay: " + (strayed.empty() ? "nothing fits better than they do" : strayed);
  return result;
}

}  // namespace vantage::align
