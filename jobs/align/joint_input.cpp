#include "jobs/align/joint_input.h"

#include <algorithm>
#include <map>

#include "jobs/align/joint_tracks.h"
#include "jobs/vision/undistort.h"
#include "schema/formats/calibration.h"
#include "schema/formats/observations.h"

namespace vantage::align {
namespace {

/// More points add time but no certainty.
constexpr std::size_t kMaxMoving = 400, kMaxStill = 1500;

/// Steps towards the point that the lens takes to px; lenses of pictures converge in a few.
Eigen::Vector2d undistorted_px(const CameraModel& camera, const Eigen::Vector2d& px) {
  if (!camera.filmed) return px;
  constexpr int kSteps = 20;
  const Eigen::Vector2d focal(camera.pinhole.fx, camera.pinhole.fy);
  Eigen::Vector2d at = camera.pinhole.ray(px).head<2>();
  for (int step = 0; step < kSteps; ++step) {
    const cv::Point2d seen = distort(*camera.filmed, {at.x(), at.y()});
    at += (px - Eigen::Vector2d(seen.x, seen.y)).cwiseQuotient(focal);
  }
  return camera.pinhole.project({at.x(), at.y(), 1});
}

const RigidTransform* pose_of(const Calibration& calibration, const std::string& camera) {
  const auto pose = calibration.cam_from_world.lower_bound({camera, 0});
  return pose != calibration.cam_from_world.end() && pose->first.camera == camera ? &pose->second : nullptr;
}

std::vector<StillPoint> read_background(const JobContext& context, const Calibration& calibration,
                                        const std::map<std::string, std::size_t>& index) {
  std::vector<StillPoint> points;
  for (const SparsePoint& point : calibration.points) points.push_back({point.position, {}});
  for (const auto& o : read_observations(context.input("calibrate") / "observations.txt"))
    if (const auto camera = index.find(o.camera); camera != index.end() && !o.frame)
      points.at(static_cast<std::size_t>(o.point))
          .seen.push_back({camera->second, undistorted_px(calibration.camera(o.camera), o.px)});
  std::erase_if(points, [](const StillPoint& point) { return point.seen.size() < 2; });
  std::stable_sort(points.begin(), points.end(),
                   [](const auto& p, const auto& q) { return p.seen.size() > q.seen.size(); });
  if (points.size() > kMaxStill) points.resize(kMaxStill);
  return points;
}

/// Of two cameras, whichever of them comes first in the shot.
std::vector<PairTracks> read_pairs(const JobContext& context, const std::vector<JointCamera>& cameras) {
  std::vector<PairTracks> pairs;
  for (std::size_t i = 0; i < cameras.size(); ++i)
    for (std::size_t j = 0; j < cameras.size(); ++j) {
      const std::string job = "sync/" + cameras[i].clock.name + "__" + cameras[j].clock.name;
      if (context.has_input(job)) pairs.push_back({i, j, read_matches(context.input(job))});
    }
  return pairs;
}

}  // namespace

JointScene read_joint_scene(const JobContext& context, const Clocks& clocks,
                            const std::map<std::string, double>& readout_ms, bool known_cameras) {
  const Calibration calibration = read_calibration(context.input("calibrate"));
  JointScene scene{.cameras = {}, .still = {}, .moving = {}, .known_cameras = known_cameras};
  std::vector<CameraTracks> tracks;
  std::map<std::string, std::size_t> index;
  for (const CameraClock& clock : clocks.cameras) {
    const RigidTransform* pose = pose_of(calibration, clock.name);
    if (!pose || !readout_ms.contains(clock.name)) continue;
    const FrameTable table = read_frame_table(context.input("ingest/" + clock.name));
    if (table.num_frames() < 2) continue;
    index[clock.name] = scene.cameras.size();
    scene.cameras.push_back({calibration.camera(clock.name).pinhole, *pose, clock,
                             table.pts_s.back() / (table.num_frames() - 1), 0.5 * table.pts_s.back()});
    tracks.push_back({read_tracks(context.input("track/" + clock.name)), table, 1e-3 * readout_ms.at(clock.name)});
  }
  if (scene.cameras.empty() || scene.cameras.front().clock.name != clocks.reference) return scene;
  scene.moving = join_tracks(scene.cameras, tracks, read_pairs(context, scene.cameras), kMaxMoving);
  if (!known_cameras) scene.still = read_background(context, calibration, index);
  return scene;
}

}  // namespace vantage::align
