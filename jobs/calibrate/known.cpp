#include "jobs/calibrate/known.h"

#include <fmt/format.h>

#include "jobs/calibrate/exchange/camera_toml.h"
#include "jobs/calibrate/exchange/nuke_chan.h"
#include "jobs/vision/undistort.h"
#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail(const fs::path& model, const std::string& what) {
  throw Error(ErrorKind::BadInput, fmt::format("{}: {}", model.string(), what));
}

std::string names_in(const Calibration& calibration) {
  std::string names;
  for (const auto& [name, camera] : calibration.cameras) names += (names.empty() ? "" : ", ") + name;
  return names;
}

/// With cameras_distorted.txt the pinhole is the model's own; otherwise it is made here from the lens.
CameraModel without_distortion(CameraModel camera, bool has_own_pinhole) {
  if (!camera.filmed || has_own_pinhole) return camera;
  camera.pinhole = undistorted_pinhole(*camera.filmed);
  if (Undistorter(camera).is_identity()) camera.filmed.reset();
  return camera;
}

void check_size(const fs::path& model, const CameraModel& camera, const FrameTable& table) {
  const int width = camera.filmed ? camera.filmed->width : camera.pinhole.width;
  const int height = camera.filmed ? camera.filmed->height : camera.pinhole.height;
  if (width != table.width || height != table.height)
    fail(model, fmt::format("camera '{}' has pictures of {}x{} px, but its footage is {}x{}", table.camera, width,
                            height, table.width, table.height));
}

/// Pose of a frame; of a static camera's frame without one the pose of the frame before it, or of its first.
const RigidTransform* pose_of(const std::map<int, RigidTransform>& poses, int frame, bool moving) {
  if (const auto found = poses.find(frame); found != poses.end()) return &found->second;
  if (moving) return nullptr;
  const auto after = poses.upper_bound(frame);
  return after == poses.begin() ? &after->second : &std::prev(after)->second;
}

/// where: the file or folder that errors name.
KnownCalibration fit_to_shot(const Calibration& given, const fs::path& where, bool has_own_pinhole,
                             const std::vector<FilmedCamera>& cameras) {
  std::map<std::string, std::map<int, RigidTransform>> poses;
  for (const auto& [image, pose] : given.cam_from_world) poses[image.camera][image.frame] = pose;
  KnownCalibration out;
  for (const auto& [table, moving, start_s] : cameras) {
    const auto found = given.cameras.find(table.camera);
    if (found == given.cameras.end())
      fail(where, fmt::format("has no image of camera '{}'; it has images of: {}", table.camera, names_in(given)));
    check_size(where, found->second, table);
    out.calibration.cameras[table.camera] = without_distortion(found->second, has_own_pinhole);
    int num_missing = 0;
    for (int frame = 0; frame < table.num_frames(); ++frame) {
      const RigidTransform* pose = pose_of(poses[table.camera], frame, moving);
      if (pose != nullptr)
        out.calibration.cam_from_world[{table.camera, frame}] = *pose;
      else
        ++num_missing;
    }
    if (num_missing == table.num_frames()) fail(where, fmt::format("no frame of camera '{}' has a pose", table.camera));
    if (num_missing > 0)
      out.warnings.push_back(fmt::format("camera '{}' moves, and {} of its {} frames have no pose", table.camera,
                                         num_missing, table.num_frames()));
  }
  out.calibration.points = given.points;
  for (auto& point : out.calibration.points)
    std::erase_if(point.seen_in, [&](const ImageId& image) { return !out.calibration.cam_from_world.contains(image); });
  return out;
}

}  // namespace

KnownCalibration known_calibration(const fs::path& model, const std::vector<FilmedCamera>& cameras) {
  if (model.extension() == ".toml") return fit_to_shot(read_camera_toml(model), model, false, cameras);
  return fit_to_shot(read_calibration(model), model, fs::exists(model / "cameras_distorted.txt"), cameras);
}

KnownCalibration known_from_chan(const std::map<std::string, fs::path>& files,
                                 const std::vector<FilmedCamera>& cameras) {
  Calibration given;
  for (const FilmedCamera& camera : cameras) {
    const std::string& name = camera.table.camera;
    const ChanCamera chan = read_chan(files.at(name));
    given.cameras[name] = {.name = name,
                           .id = static_cast<int>(given.cameras.size()) + 1,
                           .pinhole = pinhole_of_vfov(chan.vfov_deg, camera.table.width, camera.table.height),
                           .filmed = std::nullopt};
    for (const auto& [frame, pose] : chan.cam_from_world) given.cam_from_world[{name, frame}] = pose;
  }
  return fit_to_shot(given, files.begin()->second.parent_path(), false, cameras);
}

}  // namespace vantage
