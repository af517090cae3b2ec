#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <random>

#include "jobs/sync/sync_job.h"
#include "schema/formats/calibration.h"
#include "schema/formats/clocks.h"
#include "schema/formats/frame_table.h"
#include "schema/formats/moving_areas.h"
#include "schema/formats/tracks.h"
#include "tests/support/synthetic_scene.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

using synthetic::Scene;
using synthetic::SceneCamera;

struct ScenePoint {
  int id = 0;
  double time_s = 0;
  Eigen::Vector3d position;
};

/// Points on the moving things as the camera sees them in its first frame.
std::vector<ScenePoint> moving_points(const SceneCamera& camera, const synthetic::Picture& first) {
  std::vector<ScenePoint> points;
  for (int y = 2; y < first.id.rows; y += 5)
    for (int x = 2; x < first.id.cols; x += 5) {
      if (first.id(y, x) < synthetic::kFirstMovingId) continue;
      const Eigen::Vector3d in_cam = camera.pinhole.ray({x + 0.5, y + 0.5}) * double{first.depth(y, x)};
      points.push_back(
          {first.id(y, x), camera.time_s(0), camera.cam_from_world.R.transpose() * (in_cam - camera.cam_from_world.t)});
    }
  return points;
}

/// What a perfect tracker makes of a point in a camera: its first run of visible frames. Looks say which point it is.
Track track_of(const ScenePoint& point, std::size_t number, const Scene& scene, const SceneCamera& camera,
               const std::vector<synthetic::Picture>& pictures) {
  Track track{.first_frame = 0, .px = {}, .moving = true, .motion_px = 10, .looks = {}};
  for (int f = 0; f < camera.num_frames; ++f) {
    const Eigen::Vector3d in_cam =
        camera.cam_from_world * scene.moved(point.id, point.position, point.time_s, camera.time_s(f));
    const Eigen::Vector2d px = camera.pinhole.project(in_cam);
    const cv::Point pixel(static_cast<int>(px.x()), static_cast<int>(px.y()));
    const auto& depth = pictures[static_cast<std::size_t>(f)].depth;
    const bool inside = px.x() > 1 && px.y() > 1 && px.x() < depth.cols - 1 && px.y() < depth.rows - 1;
    const bool visible = inside && std::abs(double{depth(pixel)} - in_cam.z()) < 0.01 * in_cam.z();
    if (!visible && !track.px.empty()) break;
    if (!visible) continue;
    if (track.px.empty()) track.first_frame = f;
    track.px.push_back(px.cast<float>());
  }
  std::mt19937 random(static_cast<unsigned>(number));
  track.looks.resize(1);
  track.looks[0].frame = track.first_frame;
  for (auto& d : track.looks[0].descriptor) d = static_cast<std::uint8_t>(random() % 100);
  return track;
}

MovingAreas outlines_of(const std::string& camera, const std::vector<synthetic::Picture>& pictures) {
  MovingAreas areas{camera, 1, pictures[0].id.cols, pictures[0].id.rows, {}};
  for (const auto& picture : pictures) {
    auto& runs = areas.frames.emplace_back();
    const auto moves = [&](int x, int y) { return picture.id(y, x) >= synthetic::kFirstMovingId; };
    for (int y = 0; y < areas.rows; ++y)
      for (int x = 0; x < areas.columns; ++x) {
        const int begin = x;
        while (x < areas.columns && moves(x, y)) ++x;
        if (x > begin)
          runs.push_back(
              {static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(x)});
      }
  }
  return areas;
}

/// Two cameras of the ray-traced scene, on disk as the jobs before sync leave them.
class SyncRun : public testing::Test {
 protected:
  void SetUp() override {
    const Scene scene;
    const auto cameras = synthetic::arc_cameras(2, 12, 320, 180);
    offset_s_ = cameras[1].offset_s - cameras[0].offset_s;
    Calibration calibration;
    std::vector<ScenePoint> points;
    for (const SceneCamera& camera : cameras) {
      const auto ingest = folder_.path() / "ingest" / camera.name, track = folder_.path() / "track" / camera.name;
      std::filesystem::create_directories(ingest / "frames");
      std::filesystem::create_directories(track);
      FrameTable table{camera.name, 320, 180, camera.fps, {}};
      std::vector<synthetic::Picture> pictures;
      for (int f = 0; f < camera.num_frames; ++f) {
        pictures.push_back(scene.render(camera.pinhole, camera.cam_from_world, camera.time_s(f)));
        cv::imwrite(frame_path(ingest, f).string(), pictures.back().bgr);
        table.pts_s.push_back(f / camera.fps);
        calibration.cam_from_world[{camera.name, f}] = camera.cam_from_world;
      }
      write_frame_table(ingest / "frames.json", table);
      calibration.cameras[camera.name] = {camera.name, static_cast<int>(calibration.cameras.size()) + 1, camera.pinhole,
                                          std::nullopt};
      if (points.empty()) points = moving_points(camera, pictures[0]);
      TrackSet set{camera.name, 320, 180, {}};
      for (std::size_t k = 0; k < points.size(); ++k)
        if (Track t = track_of(points[k], k, scene, camera, pictures); t.px.size() >= 6)
          set.tracks.push_back(std::move(t));
      write_tracks(track / "tracks.bin", set);
      write_moving_areas(track / "moving.bin", outlines_of(camera.name, pictures));
      config_.inputs["ingest/" + camera.name] = ingest;
      config_.inputs["track/" + camera.name] = track;
    }
    std::filesystem::create_directories(folder_.path() / "calibrate");
    std::filesystem::create_directories(folder_.path() / "out");
    write_calibration(folder_.path() / "calibrate", calibration);
    config_.inputs["calibrate"] = folder_.path() / "calibrate";
    config_.unit = {{"a", cameras[0].name}, {"b", cameras[1].name}, {"moving_a", false}, {"moving_b", false}};
    config_.out_dir = folder_.path() / "out";
  }
  PairOffset run(const SyncJob::Params& params) {
    JobContext context(config_);
    SyncJob::run(context, params);
    return read_pair_offset(folder_.path() / "out");
  }
  TemporaryFolder folder_;
  JobContext::Config config_;
  double offset_s_ = 0;
};

TEST_F(SyncRun, FindsTheSubframeOffsetOfAFilmedScene) {
  const PairOffset offset = run({});
  EXPECT_TRUE(offset.determined) << offset.verdict;
  EXPECT_NEAR(offset.offset_s * 30, offset_s_ * 30, 0.1) << offset.verdict;
  for (const char* picture : {"preview.jpg", "matches.jpg", "residuals.png"})
    EXPECT_TRUE(std::filesystem::exists(folder_.path() / "out" / picture)) << picture;
}

TEST_F(SyncRun, CamerasWithoutPosesAreSolvedWithPoseAndClockTogether) {
  Calibration calibration = read_calibration(folder_.path() / "calibrate");
  calibration.cam_from_world.clear();
  write_calibration(folder_.path() / "calibrate", calibration);
  const PairOffset offset = run({});
  EXPECT_EQ(offset.method, "motion/epipolar/joint");
  EXPECT_TRUE(!offset.determined || std::abs(offset.offset_s - offset_s_) * 30 < 0.1) << offset.verdict;
  EXPECT_LT(std::abs(offset.offset_s - offset_s_) * 30, 0.5) << offset.verdict;
}

TEST_F(SyncRun, SoundlessFootageIsUndeterminedByAudio) {
  SyncJob::Params params;
  params.method = "audio";
  const PairOffset offset = run(params);
  EXPECT_FALSE(offset.determined);
  EXPECT_NE(offset.verdict.find("has no sound"), std::string::npos) << offset.verdict;
}

}  // namespace
}  // namespace vantage
