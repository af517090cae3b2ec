#include <algorithm>

#include "jobs/calibrate/calibrate_job.h"
#include "jobs/calibrate/colour_match.h"
#include "jobs/calibrate/exchange/camera_toml.h"
#include "jobs/calibrate/exchange/nuke_chan.h"
#include "jobs/calibrate/exchange/usd_cameras.h"
#include "jobs/calibrate/known.h"
#include "jobs/calibrate/preview.h"
#include "jobs/calibrate/solve.h"
#include "jobs/vision/camera_mask.h"
#include "jobs/vision/shot_images.h"
#include "schema/base/error.h"
#include "schema/base/median.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

std::vector<FilmedCamera> cameras_of(const JobContext& context) {
  std::vector<FilmedCamera> cameras;
  for (const auto& camera : context.unit().at("cameras"))
    cameras.push_back(
        {.table = read_frame_table(context.input("ingest/" + camera.at("name").get<std::string>())),
         .moving = camera.at("moving"),
         .start_s = camera.contains("start_s") ? std::optional<double>(camera["start_s"]) : std::nullopt});
  return cameras;
}

Json report_of(const Calibration& calibration, const std::vector<FilmedCamera>& cameras) {
  Json report{{"cameras", Json::array()}, {"points", calibration.points.size()}};
  for (const auto& camera : cameras) {
    const FrameTable& table = camera.table;
    Json entry{{"name", table.camera}, {"frames", table.num_frames()}, {"moving", camera.moving}, {"registered", 0}};
    if (const auto found = calibration.cameras.find(table.camera); found != calibration.cameras.end()) {
      const Pinhole& p = found->second.pinhole;
      entry.update(
          {{"fx", p.fx}, {"fy", p.fy}, {"cx", p.cx}, {"cy", p.cy}, {"has_lens", found->second.filmed.has_value()}});
      int num = 0;
      for (int frame = 0; frame < table.num_frames(); ++frame)
        num += calibration.cam_from_world.contains({table.camera, frame});
      entry["registered"] = num;
    }
    report["cameras"].push_back(entry);
  }
  report["registered_cameras"] = calibration.cameras.size();
  report["registered_images"] = calibration.cam_from_world.size();
  return report;
}

/// The cameras in other programs' words.
void publish_exchange(JobContext& context, const Calibration& calibration, bool is_metric) {
  write_camera_toml(context.out("cameras.toml"), calibration);
  write_usd_cameras(context.out("cameras.usda"), calibration, is_metric ? 1 : 0);
  std::map<std::string, std::map<int, RigidTransform>> poses;
  for (const auto& [image, pose] : calibration.cam_from_world) poses[image.camera][image.frame] = pose;
  for (const auto& [name, of_frames] : poses)
    write_chan(context.out("chan/" + name + ".chan"), calibration.camera(name).pinhole, of_frames);
}

/// Median distance of the pictures from the middle of the scene's points, in world units.
double radius_of(const Calibration& calibration) {
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const auto& point : calibration.points) values.push_back(point.position[axis]);
    middle[axis] = median(std::move(values));
  }
  std::vector<double> distances;
  for (const auto& [image, pose] : calibration.cam_from_world) distances.push_back((pose.centre() - middle).norm());
  return median(std::move(distances));
}

/// Standard deviations of every camera (the median of a moving one's key frames), and of the shot's median camera.
void report_certainty(const EstimatedCalibration& estimated, Json& report) {
  const double radius = radius_of(estimated.calibration);
  std::map<std::string, std::vector<double>> of_all;
  for (Json& camera : report["cameras"]) {
    std::map<std::string, std::vector<double>> of_camera;
    for (const auto& [image, c] : estimated.certainty) {
      if (image.camera != camera["name"]) continue;
      of_camera["centre_std"].push_back(c.centre_std);
      of_camera["centre_std_percent"].push_back(100 * c.centre_std / radius);
      of_camera["rotation_std_deg"].push_back(c.rotation_std_deg);
      of_camera["focal_std_percent"].push_back(c.focal_std_percent);
    }
    for (const auto& [name, values] : of_camera) {
      camera[name] = median(values);
      of_all[name].push_back(median(values));
    }
  }
  for (const auto& [name, values] : of_all) report[name] = median(values);
}

void publish(JobContext& context, const Calibration& calibration, const Json& report) {
  write_calibration(context.out("cameras.txt").parent_path(), calibration);
  publish_exchange(context, calibration, report.value("metric", false));
  write_json(context.out("report.json"), report);
  write_picture(context.out("preview.jpg"), top_view(calibration));
  for (const char* name :
       {"registered_cameras", "registered_images", "points", "mean_reprojection_px", "centre_std_percent",
        "rotation_std_deg", "focal_std_percent", "shared_lens", "principal_point_refined"})
    if (report.contains(name)) context.figure(name, report[name]);
}

/// By what split() gave: a COLMAP text model, a TOML file, or a .chan file per camera.
KnownCalibration read_known(const std::map<std::string, fs::path>& sources, const std::vector<FilmedCamera>& cameras) {
  if (const auto toml = sources.find("cameras.toml"); toml != sources.end())
    return known_calibration(toml->second, cameras);
  if (const auto colmap = sources.find("cameras.txt"); colmap != sources.end())
    return known_calibration(colmap->second.parent_path(), cameras);
  std::map<std::string, fs::path> chan;
  for (const auto& [name, file] : sources)
    if (name.starts_with("chan/")) chan[fs::path(name).filename().string()] = file;
  return known_from_chan(chan, cameras);
}

void run_known(JobContext& context, const CalibrateJob::Params& params, const std::vector<FilmedCamera>& cameras) {
  const auto known = read_known(context.sources(), cameras);
  for (const auto& sentence : known.warnings) context.warn(sentence);
  Json report = report_of(known.calibration, cameras);
  report["method"] = "known";
  publish(context, known.calibration, report);
  if (params.match_colour) match_colour(context, known.calibration, cameras);
}

void run_colmap_method(JobContext& context, const CalibrateJob::Params& params,
                       const std::vector<FilmedCamera>& cameras) {
  std::map<std::string, CameraMask> masks;
  for (const auto& camera : cameras) masks.emplace(camera.table.camera, CameraMask(context, camera.table));
  const Footage footage{.frame =
                            [&](const ImageId& image) {
                              return read_picture(frame_path(context.input("ingest/" + image.camera), image.frame));
                            },
                        .counts = [&](const std::string& camera, const std::vector<int>& frames) -> cv::Mat {
                          return masks.at(camera).of_plate(frames);
                        }};
  const auto estimated =
      estimate_calibration(cameras, footage, params, context.scratch(), context.cores(),
                           [&](double fraction, const std::string& phase) { context.progress(fraction, phase); });
  for (const auto& sentence : estimated.warnings) context.warn(sentence);
  Json report = report_of(estimated.calibration, cameras);
  report["method"] = "colmap";
  report["mean_reprojection_px"] = estimated.bundle.mean_px;
  report["rms_reprojection_px"] = estimated.bundle.rms_px;
  report["observations"] = estimated.bundle.num_observations;
  report["metric"] = estimated.world.is_metric;
  if (estimated.world.ground_y) report["ground_y"] = *estimated.world.ground_y;
  report["shared_lens"] = estimated.bundle.lens.shared;
  report["principal_point_refined"] = estimated.bundle.lens.centre;
  report_certainty(estimated, report);
  publish(context, estimated.calibration, report);
  if (params.match_colour) match_colour(context, estimated.calibration, cameras);
  write_observations(context.out("observations.txt"), estimated.observations);
}

}  // namespace

void CalibrateJob::run(JobContext& context, const Params& params) {
  const auto cameras = cameras_of(context);
  if (params.method == "known")
    run_known(context, params, cameras);
  else
    run_colmap_method(context, params, cameras);
}

}  // namespace vantage
