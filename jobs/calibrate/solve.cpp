#include "jobs/calibrate/solve.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "jobs/calibrate/frame_poses.h"
#include "jobs/calibrate/gauge.h"
#include "jobs/vision/undistort.h"
#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

using Progress = std::function<void(double, const std::string&)>;

/// A second, looser attempt is made when a camera is missing; the better one counts.
SparseModel reconstruct(const fs::path& pictures, const Survey& survey, std::size_t num_cameras,
                        const CalibrateJob::Params& params, const fs::path& work, int num_threads,
                        const Progress& on_progress) {
  ColmapOptions options{.lens = params.lens,
                        .max_picture_px = params.feature_width_px,
                        .max_features = params.max_features,
                        .max_reproj_error_px = params.max_reproj_error_px,
                        .num_threads = num_threads,
                        .on_progress = [&](double f, const std::string& phase) { on_progress(0.1 + 0.4 * f, phase); }};
  fs::create_directories(work / "first");
  SparseModel first = run_colmap(pictures, survey.pairs(), work / "first", options);
  if (first.lenses.size() == num_cameras) return first;
  options.loose = true;
  options.on_progress = [&](double f, const std::string& phase) {
    on_progress(0.5 + 0.3 * f, phase + ", second attempt");
  };
  fs::create_directories(work / "second");
  SparseModel second = run_colmap(pictures, survey.pairs(), work / "second", options);
  const auto rank = [](const SparseModel& m) { return std::pair(m.lenses.size(), m.cam_from_world.size()); };
  return rank(second) > rank(first) ? second : first;
}

[[noreturn]] void fail_with_nothing_in_common(const SparseModel& model, const fs::path& pictures, const Survey& survey,
                                              std::size_t num_cameras) {
  const BestPair best = best_pair(pictures, survey);
  throw Error(
      ErrorKind::BadInput,
      fmt::format(
          "calibrate: cameras see nothing in common: {} of {} could be placed, expected at least 2; the best pair, {} "
          "and {}, has "
          "{} matching features, about 50 are needed. Film a textured background, put cameras at most 15 degrees "
          "apart, or give a known calibration",
          model.num_cameras(), num_cameras, best.a, best.b, best.num_matches));
}

CameraModel camera_model(const std::string& name, int id, const LensModel& lens) {
  CameraModel out{.name = name, .id = id, .pinhole = undistorted_pinhole(lens), .filmed = lens};
  if (Undistorter(out).is_identity()) out.filmed.reset();
  return out;
}

/// Poses of all frames of a camera whose pictures in the model have one.
void spread_poses(const SparseModel& model, const FilmedCamera& camera, const FrameReader& read,
                  EstimatedCalibration& out) {
  const FrameTable& table = camera.table;
  if (!camera.moving) {
    for (int frame = 0; frame < table.num_frames(); ++frame)
      out.calibration.cam_from_world[{table.camera, frame}] = model.cam_from_world.at({table.camera, 0});
    return;
  }
  const FramePoses poses = place_frames(model, table.camera, table.pts_s, [&](int frame) {
    return read({table.camera, frame});
  });
  for (const auto& [frame, pose] : poses.cam_from_world) out.calibration.cam_from_world[{table.camera, frame}] = pose;
  if (poses.num_interpolated > 0)
    out.warnings.push_back(
        fmt::format("camera '{}': {} of {} frames show too little to be placed; their poses are interpolated",
                    table.camera, poses.num_interpolated, table.num_frames()));
}

std::vector<SparsePoint> points_of(const SparseModel& model) {
  std::vector<SparsePoint> out;
  for (const auto& p : model.points)
    out.push_back({.position = p.position, .rgb = p.rgb, .error_px = 0, .seen_in = {}});
  for (const auto& o : model.observations) out[static_cast<std::size_t>(o.point)].seen_in.push_back(o.image);
  for (std::size_t i = 0; i < out.size(); ++i) std::sort(out[i].seen_in.begin(), out[i].seen_in.end());
  return out;
}

std::vector<PointObservation> observations_of(const SparseModel& model, const std::vector<FilmedCamera>& cameras) {
  std::map<std::string, bool> is_moving;
  for (const auto& camera : cameras) is_moving[camera.table.camera] = camera.moving;
  std::vector<PointObservation> out;
  for (const auto& o : model.observations) {
    const auto frame = is_moving.at(o.image.camera) ? std::optional(o.image.frame) : o.frame;
    out.push_back({.point = o.point, .camera = o.image.camera, .frame = frame, .px = o.px});
  }
  return out;
}

/// "cam0 cam3" of the options, which check() has seen.
std::optional<KnownDistance> known_distance(const CalibrateJob::Params& params) {
  if (params.known_distance.empty()) return std::nullopt;
  KnownDistance known{.from = {}, .to = {}, .metres = params.known_distance_m};
  std::istringstream(params.known_distance) >> known.from >> known.to;
  return known;
}

}  // namespace

EstimatedCalibration estimate_calibration(const std::vector<FilmedCamera>& cameras, const FrameReader& read,
                                          const CalibrateJob::Params& params, const fs::path& work, int num_threads,
                                          const Progress& on_progress) {
  on_progress(0, "pictures");
  const fs::path pictures = work / "pictures";
  const Survey survey = write_survey(pictures, cameras, read, params.plate_frames, params.max_key_frames);
  SparseModel model = reconstruct(pictures, survey, cameras.size(), params, work, num_threads, on_progress);
  if (model.num_cameras() < 2) fail_with_nothing_in_common(model, pictures, survey, cameras.size());
  on_progress(0.8, "bundle adjustment");
  EstimatedCalibration out;
  out.bundle = refine_bundle(model, params.max_reproj_error_px);
  out.bundle = drop_idle_lenses(model, params.max_reproj_error_px, out.bundle);
  on_progress(0.9, "poses of all frames");
  int id = 0;
  for (const auto& camera : cameras) {
    const std::string& name = camera.table.camera;
    ++id;
    if (!model.lenses.contains(name)) {
      out.warnings.push_back(
          fmt::format("camera '{}' shares too little with the others and could not be placed: it is left out", name));
      continue;
    }
    out.calibration.cameras[name] = camera_model(name, id, model.lenses.at(name));
    spread_poses(model, camera, read, out);
  }
  out.calibration.points = points_of(model);
  out.observations = observations_of(model, cameras);
  out.world = normalise_world(out.calibration, known_distance(params));
  return out;
}

}  // namespace vantage
