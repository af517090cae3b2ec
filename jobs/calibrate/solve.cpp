#include "jobs/calibrate/solve.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "jobs/calibrate/frame_poses.h"
#include "jobs/calibrate/gauge.h"
#include "jobs/calibrate/lens_choice.h"
#include "jobs/calibrate/reconstruct.h"
#include "jobs/vision/undistort.h"
#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

using Progress = std::function<void(double, const std::string&)>;

[[noreturn]] void fail_with_nothing_in_common(const Reconstruction& found, std::size_t num_cameras) {
  const auto& best = found.best_pair;
  throw Error(
      ErrorKind::BadInput,
      fmt::format("calibrate: cameras see nothing in common: {} of {} could be placed, expected at least 2; the "
                  "best pair, {} and {}, has {} matching features, about 50 are needed. Film a textured "
                  "background, put cameras at most 15 degrees apart, say when each started (start_s and [sync] "
                  "method = \"known\"), or give a known calibration",
                  found.model.num_cameras(), num_cameras, best.a, best.b, best.num_matches));
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
  for (const auto& o : model.observations)
    out[static_cast<std::size_t>(o.point)].seen_in.push_back({o.image.camera, o.frame.value_or(o.image.frame)});
  for (std::size_t i = 0; i < out.size(); ++i) std::sort(out[i].seen_in.begin(), out[i].seen_in.end());
  return out;
}

std::vector<PointObservation> observations_of(const SparseModel& model) {
  std::vector<PointObservation> out;
  for (const auto& o : model.observations) {
    out.push_back({.point = o.point, .camera = o.image.camera, .frame = o.frame, .px = o.px - o.carried_px});
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

/// Mean distance of the pictures' centres from their middle.
double spread_of(const SparseModel& model, const std::map<ImageId, RigidTransform>& cam_from_world) {
  const double num = static_cast<double>(model.cam_from_world.size());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& [image, pose] : model.cam_from_world) middle += cam_from_world.at(image).centre() / num;
  double spread = 0;
  for (const auto& [image, pose] : model.cam_from_world)
    spread += (cam_from_world.at(image).centre() - middle).norm() / num;
  return spread;
}

/// In the units of the calibration's world.
std::map<ImageId, CameraCertainty> scaled_certainty(SparseModel& model, const EstimatedCalibration& estimated) {
  auto out = certainty_of(model, estimated.bundle.lens);
  const double before = spread_of(model, model.cam_from_world);
  if (!(before > 0)) return {};
  const double scale = spread_of(model, estimated.calibration.cam_from_world) / before;
  for (auto& [image, certainty] : out) certainty.centre_std *= scale;
  return out;
}

}  // namespace

EstimatedCalibration estimate_calibration(const std::vector<FilmedCamera>& cameras, const Footage& footage,
                                          const CalibrateJob::Params& params, const fs::path& work, int num_threads,
                                          const Progress& on_progress) {
  Reconstruction found = reconstruct(cameras, footage, params, work / "colmap", num_threads,
                                     [&](double f, const std::string& phase) { on_progress(0.8 * f, phase); });
  if (found.model.num_cameras() < 2) fail_with_nothing_in_common(found, cameras.size());
  SparseModel& model = found.model;
  on_progress(0.8, "bundle adjustment");
  EstimatedCalibration out;
  const BundleOptions bundle{.max_error_px = params.max_reproj_error_px, .lens = {}};
  out.bundle = choose_lenses(model, bundle);
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
    spread_poses(model, camera, footage.frame, out);
  }
  out.calibration.points = points_of(model);
  out.observations = observations_of(model);
  out.world = normalise_world(out.calibration, known_distance(params));
  out.certainty = scaled_certainty(model, out);
  return out;
}

}  // namespace vantage
