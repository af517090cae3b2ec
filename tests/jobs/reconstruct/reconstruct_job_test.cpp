#include "jobs/reconstruct/reconstruct_job.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

#include "schema/formats/calibration.h"
#include "schema/formats/clocks.h"
#include "schema/formats/frame_table.h"
#include "schema/formats/patches.h"
#include "tests/support/synthetic_scene.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

/// A shot of 4 cameras with the artifacts that reconstruct needs. Cameras are filmed for real only when asked to.
struct Fixture {
  TemporaryFolder folder;
  Shot shot;
  std::vector<synthetic::SceneCamera> cameras = synthetic::arc_cameras(4, 6, 160, 90);

  explicit Fixture(bool with_pictures) {
    const synthetic::Scene scene;
    Calibration calibration;
    Clocks clocks{cameras.front().name, {}};
    for (const auto& camera : cameras) {
      ShotCamera in_shot;
      in_shot.name = camera.name;
      shot.cameras.push_back(in_shot);
      clocks.cameras.push_back({camera.name, camera.offset_s, 1, 0});
      CameraModel model;
      model.name = camera.name;
      model.id = static_cast<int>(calibration.cameras.size()) + 1;
      model.pinhole = camera.pinhole;
      calibration.cameras[camera.name] = model;
      FrameTable table{camera.name, 160, 90, camera.fps, {}};
      fs::create_directories(artifact("ingest/" + camera.name) / "frames");
      for (int f = 0; f < camera.num_frames; ++f) {
        table.pts_s.push_back(f / camera.fps);
        calibration.cam_from_world[{camera.name, f}] = camera.cam_from_world;
        if (with_pictures)
          cv::imwrite(frame_path(artifact("ingest/" + camera.name), f).string(),
                      scene.render(camera.pinhole, camera.cam_from_world, camera.time_s(f)).bgr);
      }
      write_frame_table(artifact("ingest/" + camera.name) / "frames.json", table);
    }
    fs::create_directories(artifact("calibrate"));
    write_calibration(artifact("calibrate"), calibration);
    fs::create_directories(artifact("align"));
    write_clocks(artifact("align") / "clocks.json", clocks);
    shot.sections["reconstruct"] = {};
  }
  fs::path artifact(const std::string& job) const { return folder.path() / job; }
  std::vector<WorkUnit> split(const ReconstructJob::Params& params = {}) const {
    const ShotState state(shot, [this](const std::string& job) {
      return fs::exists(artifact(job)) ? std::optional(artifact(job)) : std::nullopt;
    });
    return ReconstructJob::split(state, params);
  }
};

TEST(ReconstructSplit, MakesAJobPerGroupThatNeedsItsCameras) {
  const Fixture fixture(false);
  const auto units = fixture.split();
  ASSERT_GE(units.size(), 2U);
  EXPECT_EQ(units[1].name, "reconstruct/0001");
  EXPECT_EQ(units[0].needs.size(), 2 + fixture.cameras.size());
  std::size_t most = 0;  // the first and last windows miss the cameras that were not filming yet
  for (const auto& unit : units) most = std::max(most, unit.unit.at("images").size());
  EXPECT_GE(most, 13U);
  EXPECT_LE(most, 16U);
}

TEST(ReconstructSplit, WaitsForWhatItNeedsAndForItsSection) {
  Fixture fixture(false);
  fs::remove_all(fixture.artifact("align"));
  EXPECT_TRUE(fixture.split().empty());
  Fixture unasked(false);
  unasked.shot.sections.clear();
  EXPECT_TRUE(unasked.split().empty());
}

TEST(ReconstructSplit, CamerasWithoutAClockAreLeftOut) {
  Fixture fixture(false);
  Clocks clocks = read_clocks(fixture.artifact("align"));
  clocks.cameras.pop_back();
  write_clocks(fixture.artifact("align") / "clocks.json", clocks);
  for (const auto& unit : fixture.split()) EXPECT_EQ(unit.needs.size(), 2 + 3U);
}

TEST(ReconstructRun, WritesPatchesAndPreview) {
  const Fixture fixture(true);
  const WorkUnit unit = fixture.split().at(0);
  JobContext::Config config;
  config.unit = unit.unit;
  config.out_dir = fixture.folder.path() / "out";
  fs::create_directories(config.out_dir);
  for (const auto& need : unit.needs) config.inputs[need] = fixture.artifact(need);
  JobContext context(config);
  ReconstructJob::run(context, {});
  const auto patches = read_patches_ply(config.out_dir / "patches.ply");
  EXPECT_GE(patches.size(), 500U);
  EXPECT_EQ(static_cast<std::size_t>(context.figures().at("patches").get<int>()), patches.size());
  EXPECT_EQ(cv::imread((config.out_dir / "preview.jpg").string()).cols, 480);
}

}  // namespace
}  // namespace vantage
