#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "jobs/align/align_job.h"
#include "jobs/align/clock_graph.h"
#include "jobs/align/graph_picture.h"
#include "jobs/align/joint_adjustment.h"
#include "jobs/align/joint_input.h"
#include "jobs/align/readout.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/formats/frame_table.h"

namespace vantage {
namespace {

struct Camera {
  std::string name;
  double start_s = 0;
  FrameTable table;
};

std::vector<Camera> read_cameras(const JobContext& context) {
  std::vector<Camera> cameras;
  for (const Json& c : context.unit().at("cameras")) {
    const std::string name = c.at("name");
    cameras.push_back({name, c.value("start_s", 0.0), read_frame_table(context.input("ingest/" + name))});
  }
  return cameras;
}

/// Shot times of a camera's first and last frame.
std::pair<double, double> span_s(const CameraClock& clock, const std::vector<Camera>& cameras) {
  const auto camera =
      std::find_if(cameras.begin(), cameras.end(), [&](const Camera& c) { return c.name == clock.name; });
  return {clock.shot_time_s(0), clock.shot_time_s(camera->table.pts_s.back())};
}

void warn_of_cameras_without_company(JobContext& context, const Clocks& clocks, const std::vector<Camera>& cameras) {
  for (const CameraClock& one : clocks.cameras) {
    const auto [begin, end] = span_s(one, cameras);
    const bool company = std::any_of(clocks.cameras.begin(), clocks.cameras.end(), [&](const CameraClock& other) {
      const auto [other_begin, other_end] = span_s(other, cameras);
      return other.name != one.name && other_begin <= end && begin <= other_end;
    });
    // Stills are one moment each: they never overlap, and need not.
    if (!company && end > begin) context.warn(one.name + " films at no time when another camera does");
  }
}

Clocks known_clocks(const std::vector<Camera>& cameras) {
  Clocks clocks{cameras.front().name, {}};
  for (const Camera& camera : cameras) clocks.cameras.push_back({camera.name, camera.start_s, 1, 0});
  return clocks;
}

double frame_s(const FrameTable& table) {
  return table.num_frames() > 1 ? table.pts_s.back() / (table.num_frames() - 1) : 1 / std::max(table.fps, 1.0);
}

std::vector<PairOffset> read_pairs(const JobContext& context, const std::vector<Camera>& cameras) {
  std::vector<PairOffset> pairs;
  for (std::size_t i = 0; i < cameras.size(); ++i)
    for (std::size_t j = i + 1; j < cameras.size(); ++j)
      pairs.push_back(read_pair_offset(context.input("sync/" + cameras[i].name + "__" + cameras[j].name)));
  return pairs;
}

/// What the pair that came nearest to an answer says of a camera that has none.
std::string best_verdict(const std::vector<PairOffset>& pairs, const std::string& camera) {
  const PairOffset* best = nullptr;
  for (const PairOffset& pair : pairs)
    if ((pair.a == camera || pair.b == camera) && (!best || pair.std_s < best->std_s)) best = &pair;
  return best ? fmt::format("{} and {}: {}", best->a, best->b, best->verdict) : "it is the only camera";
}

void report(JobContext& context, const align::ClockSolution& solution, const std::vector<PairOffset>& pairs) {
  double sum_squares = 0, worst_std = 0;
  int num_used = 0, num_rejected = 0;
  for (const auto& r : solution.residuals) {
    if (r.rejected)
      context.warn(fmt::format("offset of {} and {} is {:.1f} ms from what the other pairs say: not used",
                               pairs[r.pair].a, pairs[r.pair].b, 1e3 * r.residual_s));
    num_rejected += r.rejected ? 1 : 0;
    num_used += r.rejected ? 0 : 1;
    sum_squares += r.rejected ? 0 : r.residual_s * r.residual_s;
  }
  for (const auto& clock : solution.clocks.cameras) worst_std = std::max(worst_std, clock.offset_std_s);
  context.figure("pairs_used", num_used);
  context.figure("pairs_rejected", num_rejected);
  context.figure("pairs_undetermined",
                 std::count_if(pairs.begin(), pairs.end(), [](const PairOffset& p) { return !p.determined; }));
  context.figure("rms_inconsistency_ms", 1e3 * std::sqrt(sum_squares / std::max(num_used, 1)));
  context.figure("worst_std_ms", 1e3 * worst_std);
  for (const std::string& name : solution.left_out)
    context.warn(
        fmt::format("{} could not be synchronised with any other camera and is left out ({}): give it start_s, "
                    "or footage that shares moving things with its neighbours",
                    name, best_verdict(pairs, name)));
}

/// A read-out that is neither given nor negligible shifts moving things by rows.
void report_readouts(JobContext& context, const std::vector<Camera>& cameras) {
  constexpr double kMinStds = 3, kMinReadoutS = 3e-3;
  std::vector<PairShutter> pairs;
  std::vector<align::ShutterCamera> shutters;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    shutters.push_back({cameras[i].name, frame_s(cameras[i].table)});
    for (std::size_t j = i + 1; j < cameras.size(); ++j)
      if (auto pair = read_pair_shutter(context.input("sync/" + cameras[i].name + "__" + cameras[j].name)))
        pairs.push_back(std::move(*pair));
  }
  for (const align::Readout& r : align::estimate_readouts(pairs, shutters)) {
    if (r.readout_s < std::max(kMinReadoutS, kMinStds * r.std_s)) continue;
    context.warn(
        fmt::format("{}'s pictures look as if their rows were read out over {:.1f} ± {:.1f} ms more than its "
                    "readout_ms says: set readout_ms if it has a rolling shutter",
                    r.camera, 1e3 * r.readout_s, 1e3 * r.std_s));
  }
}

[[noreturn]] void nothing_synchronised(const std::vector<PairOffset>& pairs) {
  throw Error(
      ErrorKind::BadInput,
      fmt::format("align: no pair could be synchronised: {} of {} pairs are undetermined (first: {} and {}, {}). Set "
                  "[sync] method "
                  "= \"known\" and start_s of every camera, or film something that moves in view of several cameras",
                  pairs.size(), pairs.size(), pairs.front().a, pairs.front().b, pairs.front().verdict));
}

Clocks solved_clocks(JobContext& context, const std::vector<Camera>& cameras, const AlignJob::Params& params) {
  const std::vector<PairOffset> pairs = read_pairs(context, cameras);
  std::vector<align::GraphCamera> graph_cameras;
  for (const Camera& camera : cameras) graph_cameras.push_back({camera.name, frame_s(camera.table)});
  const auto solution = align::solve_clocks(graph_cameras, pairs, cameras.front().start_s,
                                            {params.max_inconsistency_std, params.max_inconsistency_frames});
  if (solution.clocks.cameras.size() < 2) nothing_synchronised(pairs);
  report(context, solution, pairs);
  report_readouts(context, cameras);
  write_file_atomically(context.out("preview.svg"), align::graph_picture(graph_cameras, pairs, solution));
  if (solution.clocks.reference != cameras.front().name)
    context.warn(
        fmt::format("{} cannot be the reference, which is now {}", cameras.front().name, solution.clocks.reference));
  return solution.clocks;
}

/// Largest turn and change of focal length of a camera.
void report_poses(JobContext& context, const align::JointScene& scene, const align::JointResult& result) {
  double turn_deg = 0, focal_percent = 0;
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    const align::JointCamera &was = scene.cameras[i], &is = result.cameras[i];
    const Eigen::AngleAxisd turn(is.cam_from_world.R * was.cam_from_world.R.transpose());
    turn_deg = std::max(turn_deg, turn.angle() * 180 / M_PI);
    focal_percent = std::max(focal_percent, 100 * std::abs(is.lens.fx / was.lens.fx - 1));
  }
  context.figure("joint_largest_turn_deg", turn_deg);
  context.figure("joint_largest_focal_change_percent", focal_percent);
}

void report_joint(JobContext& context, const align::JointScene& scene, const align::JointResult& result) {
  context.figure("joint_verdict", result.verdict);
  context.figure("joint_moving_points", result.num_moving);
  if (result.num_moving == 0) return;
  context.figure("joint_still_points", result.num_still);
  context.figure("joint_error_before_px", result.error_before_px);
  context.figure("joint_error_after_px", result.error_after_px);
  context.figure("joint_noise_px", result.noise.sample_px);
  context.figure("joint_bias_px", result.noise.bias_px);
  context.figure("joint_largest_change_ms", 1e3 * result.largest_change_s);
  if (!scene.known_cameras) report_poses(context, scene, result);
}

/// The clocks with those of static calibrated cameras refined; as they are where that is no better.
Clocks refined_jointly(JobContext& context, const Clocks& clocks, const Json& joint) {
  const auto scene = align::read_joint_scene(context, clocks, joint.at("static_readout_ms"), joint.at("known_cameras"));
  context.progress(0.2, "adjusting clocks and cameras jointly");
  const align::JointResult result = align::adjust_jointly(scene);
  report_joint(context, scene, result);
  Clocks refined = clocks;
  if (!result.accepted) return clocks;
  for (const align::JointCamera& camera : result.cameras)
    for (CameraClock& clock : refined.cameras)
      if (clock.name == camera.clock.name) clock = camera.clock;
  return refined;
}

}  // namespace

void AlignJob::run(JobContext& context, const Params& params) {
  const std::vector<Camera> cameras = read_cameras(context);
  const bool known = context.unit().at("known");
  Clocks clocks = known ? known_clocks(cameras) : solved_clocks(context, cameras, params);
  if (context.unit().contains("joint")) clocks = refined_jointly(context, clocks, context.unit().at("joint"));
  warn_of_cameras_without_company(context, clocks, cameras);
  context.figure("cameras", clocks.cameras.size());
  write_clocks(context.out("clocks.json"), clocks);
}

}  // namespace vantage
