#include "jobs/correspond/correspond_job.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "jobs/vision/maps.h"
#include "jobs/vision/shot_images.h"
#include "schema/formats/frame_table.h"
#include "schema/formats/navspace.h"
#include "tests/support/synthetic_scene.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

using synthetic::SceneCamera;

/// Two cameras of two frames each, calibrated, in a navigation space of five edges.
class CorrespondJobTest : public testing::Test {
 protected:
  CorrespondJobTest() : cameras_(synthetic::arc_cameras(2, 2, 160, 90)) {
    Calibration calibration;
    Navspace navspace;
    for (const SceneCamera& camera : cameras_) {
      shot_.cameras.emplace_back().name = camera.name;
      calibration.cameras[camera.name] = {camera.name, static_cast<int>(calibration.cameras.size()) + 1, camera.pinhole,
                                          std::nullopt};
      FrameTable table{camera.name, 160, 90, camera.fps, {}};
      for (int frame = 0; frame < 2; ++frame) {
        calibration.cam_from_world[{camera.name, frame}] = camera.cam_from_world;
        navspace.vertices.push_back({{camera.name, frame}, 0, 0, camera.time_s(frame)});
        table.pts_s.push_back(frame / camera.fps);
        write_frame(camera, frame);
      }
      write_frame_table(artifact("ingest/" + camera.name) / "frames.json", table);
    }
    navspace.edges = {{0, 1}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
    write_calibration(artifact("calibrate"), calibration);
    write_navspace(artifact("navspace") / "navspace.json", navspace);
  }

  std::filesystem::path artifact(const std::string& job) {
    const auto path = folder_.path() / job;
    std::filesystem::create_directories(path);
    return path;
  }
  void write_frame(const SceneCamera& camera, int frame) {
    const auto path = frame_path(artifact("ingest/" + camera.name), frame);
    std::filesystem::create_directories(path.parent_path());
    write_picture(path, scene_.render(camera.pinhole, camera.cam_from_world, camera.time_s(frame)).bgr);
  }
  std::vector<WorkUnit> split(bool finished = true) {
    return CorrespondJob::split(ShotState(shot_,
                                          [&](const std::string& job) -> std::optional<std::filesystem::path> {
                                            if (!finished && job == "navspace") return std::nullopt;
                                            return folder_.path() / job;
                                          }),
                                {});
  }

  JobContext context_of(const WorkUnit& unit) {
    JobContext::Config config{.unit = unit.unit,
                              .inputs = {},
                              .sources = {},
                              .out_dir = artifact("out"),
                              .scratch_dir = artifact("scratch"),
                              .cores = 1,
                              .on_progress = {}};
    for (const std::string& need : unit.needs) config.inputs[need] = folder_.path() / need;
    for (const Source& source : unit.sources) config.sources[source.name] = source.path;
    return JobContext(config);
  }

  TemporaryFolder folder_;
  std::vector<SceneCamera> cameras_;
  synthetic::Scene scene_;
  Shot shot_;
};

TEST_F(CorrespondJobTest, WaitsForTheNavigationSpace) {
  shot_.sections["depth"] = {"shot.toml", "depth", 3, {}};
  EXPECT_TRUE(split(false).empty());
}

TEST_F(CorrespondJobTest, DepthWantsEveryEdgeOnce) {
  shot_.sections["depth"] = {"shot.toml", "depth", 3, {}};
  const auto units = split();
  ASSERT_EQ(units.size(), 5U);
  const ImageId first{cameras_[0].name, 0}, second{cameras_[0].name, 1};
  EXPECT_EQ(units[0].name, "correspond/" + first.label() + "__" + second.label());
  EXPECT_EQ(units[0].needs, (std::vector<std::string>{"calibrate", "ingest/" + cameras_[0].name}));
  EXPECT_EQ(units[1].needs.size(), 3U);
}

TEST_F(CorrespondJobTest, NothingIsMatchedThatNothingReads) { EXPECT_TRUE(split().empty()); }

TEST_F(CorrespondJobTest, UnitsNameNothingButTheirTwoImages) {
  shot_.sections["depth"] = {"shot.toml", "depth", 3, {}};
  for (const WorkUnit& unit : split()) {
    EXPECT_EQ(unit.unit.size(), 2U);
    EXPECT_EQ(std::count(unit.needs.begin(), unit.needs.end(), "navspace"), 0);
  }
}

TEST_F(CorrespondJobTest, RunWritesBothMapsAndAPicture) {
  shot_.sections["depth"] = {"shot.toml", "depth", 3, {}};
  JobContext context = context_of(split()[1]);
  CorrespondJob::run(context, {});
  for (const char* name : {"forward.exr", "backward.exr"}) {
    const FlowMap flow = read_flow(folder_.path() / "out" / name);
    EXPECT_EQ(flow.motion_px.size(), cv::Size(160, 90));
    EXPECT_TRUE(cv::checkRange(flow.motion_px));
    EXPECT_GT(cv::countNonZero(flow.confidence > 0), 160 * 90 / 2);
  }
  EXPECT_EQ(cv::imread((folder_.path() / "out/preview.jpg").string()).cols, 1200);
  EXPECT_GT(context.figures().at("consistent_percent").get<double>(), 50);
}

TEST_F(CorrespondJobTest, MaskedPixelsHaveNoConfidence) {
  shot_.sections["depth"] = {"shot.toml", "depth", 3, {}};
  shot_.folder = folder_.path();
  shot_.cameras[1].mask = "mask.png";
  cv::Mat1b mask(90, 160, uchar{255});
  mask.colRange(0, 80).setTo(0);
  write_picture(folder_.path() / "mask.png", mask);
  EXPECT_EQ(split()[4].sources.size(), 1U) << "both frames of the camera have one mask";
  const WorkUnit unit = split()[1];
  ASSERT_EQ(unit.sources.size(), 1U);
  JobContext context = context_of(unit);
  CorrespondJob::run(context, {});
  const FlowMap forward = read_flow(folder_.path() / "out/forward.exr");
  const FlowMap backward = read_flow(folder_.path() / "out/backward.exr");
  EXPECT_EQ(cv::countNonZero(backward.confidence.colRange(0, 80) > 0), 0);
  EXPECT_GT(cv::countNonZero(backward.confidence.colRange(80, 160) > 0), 3000);
  int num_into_the_mask = 0;
  for (int y = 0; y < 90; ++y)
    for (int x = 0; x < 160; ++x)
      num_into_the_mask += forward.confidence(y, x) > 0 && static_cast<float>(x) + forward.motion_px(y, x)[0] < 79;
  EXPECT_EQ(num_into_the_mask, 0);
  EXPECT_GT(cv::countNonZero(forward.confidence > 0), 3000);
}

}  // namespace
}  // namespace vantage
