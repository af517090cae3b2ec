/// From shot.toml's matte and over to the job's frame, through split() and run().
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "jobs/render/composite.h"
#include "jobs/render/render_job.h"
#include "jobs/render/write_frame.h"
#include "jobs/views/frame_plan.h"
#include "jobs/vision/maps.h"
#include "schema/base/error.h"
#include "schema/formats/frame_table.h"
#include "schema/formats/navspace.h"
#include "tests/support/synthetic_scene.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

constexpr int kWidth = 96, kHeight = 54;
const cv::Rect kActor(36, 15, 24, 24);  ///< in the masks: full within, half in a rim of 3 px around

/// Two still cameras side by side before a grey wall at distance 4, two frames each; all depths are known.
class CompositeJobTest : public testing::Test {
 protected:
  CompositeJobTest() {
    shot_.folder = folder_.path();
    Calibration calibration;
    Navspace navspace;
    navspace.centre = {0, 0, 4};
    navspace.radius = 4;
    navspace.axes << 1, 0, 0, 0, -1, 0, 0, 0, -1;
    for (int k = 0; k < 2; ++k) {
      const std::string name = fmt::format("cam{}", k);
      shot_.cameras.emplace_back().name = name;
      shot_.cameras.back().line = 10 + k;
      calibration.cameras[name] = {name, k + 1, {kWidth, kHeight, 90, 90, kWidth / 2.0, kHeight / 2.0}, std::nullopt};
      for (int frame = 0; frame < 2; ++frame) {
        RigidTransform pose;
        pose.t.x() = k == 0 ? 0.02 : -0.02;
        calibration.cam_from_world[{name, frame}] = pose;
        navspace.vertices.push_back({{name, frame}, k == 0 ? -0.29 : 0.29, 0, frame / 30.0});
        write_depth(artifact(depth_job({name, frame})) / "depth.exr",
                    {cv::Mat1f(kHeight, kWidth, 4.0F), cv::Mat1f(kHeight, kWidth, 1.0F)});
        const fs::path picture = frame_path(artifact("ingest/" + name), frame);
        fs::create_directories(picture.parent_path());
        cv::imwrite(picture.string(), cv::Mat3b(kHeight, kWidth, cv::Vec3b(188, 188, 188)));
      }
      write_frame_table(artifact("ingest/" + name) / "frames.json", {name, kWidth, kHeight, 30, {0, 1 / 30.0}});
    }
    navspace.simplices = {{0, 1, 2}, {1, 2, 3}};
    navspace.edges = {{0, 1}, {0, 2}, {1, 2}, {1, 3}, {2, 3}};
    write_calibration(artifact("calibrate"), calibration);
    write_navspace(artifact("navspace") / "navspace.json", navspace);
    RenderRequest request;
    request.name = "r";
    request.keyframes = {{0, 0.01, 0, 0}, {0.04, 0.01, 0, 0}};
    request.options = {"shot.toml", "render", 7, {}};
    request.line = 7;
    shot_.renders = {request};
    option("method", "depth");
  }

  fs::path artifact(const std::string& job) {
    fs::create_directories(folder_.path() / "store" / job);
    return folder_.path() / "store" / job;
  }
  void option(const std::string& key, const Json& value) {
    const int line = 20 + static_cast<int>(shot_.renders[0].options.values.size());
    shot_.renders[0].options.values[key] = {value, line};
  }
  void give_masks() {
    cv::Mat1b mask(kHeight, kWidth, uchar{0});
    mask(cv::Rect(kActor.x - 3, kActor.y - 3, kActor.width + 6, kActor.height + 6)).setTo(128);
    mask(kActor).setTo(255);
    cv::imwrite((folder_.path() / "mask.png").string(), mask);
    for (ShotCamera& camera : shot_.cameras) camera.mask = "mask.png";
    option("matte", "mask");
  }
  /// The frames of a render of the set: blue, at that distance.
  void give_set(cv::Size size, float z) {
    fs::create_directories(folder_.path() / "set");
    for (int frame = 0; frame < 2; ++frame)
      write_frame_exr(folder_.path() / fmt::format("set/frame.{:06d}.exr", frame),
                      {{"",
                        {cv::Mat3f(size, cv::Vec3f(0.5F, 0, 0)),
                         cv::Mat1f(size, 1.0F),
                         cv::Mat1f(size, z),
                         cv::Mat1f(size, 0.0F),
                         {}},
                        {}}});
    option("over", "set");
  }

  std::vector<WorkUnit> split() {
    return RenderJob::split(
        ShotState(shot_,
                  [&](const std::string& job) -> std::optional<fs::path> { return folder_.path() / "store" / job; }),
        {});
  }
  /// The first frame, as its job writes it.
  ViewPicture drawn() {
    const WorkUnit unit = split().at(0);
    JobContext::Config config{.unit = Json::parse(unit.unit.dump()),
                              .inputs = {},
                              .sources = {},
                              .out_dir = artifact("out"),
                              .scratch_dir = artifact("scratch"),
                              .cores = 1,
                              .on_progress = {}};
    for (const std::string& need : unit.needs) {
      config.inputs[need] = artifact(need);
      if (!need.starts_with("correspond/")) continue;
      for (const char* way : {"forward.exr", "backward.exr"})  // depth alone is to be believed
        write_flow(artifact(need) / way,
                   {cv::Mat2f(kHeight, kWidth, cv::Vec2f(0, 0)), cv::Mat1f(kHeight, kWidth, 0.0F)});
    }
    for (const Source& source : unit.sources) config.sources[source.name] = source.path;
    JobContext context(config);
    RenderJob::run(context, {});
    return read_rendered(artifact("out") / "frame.exr", "", {kWidth, kHeight});
  }
  static void expect_error(const std::function<void()>& act, const std::vector<std::string>& words) {
    try {
      act();
      FAIL() << "no error that says " << words.at(0);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::BadInput);
      for (const std::string& word : words) EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
    }
  }

  const cv::Point inside_{48, 27}, rim_{34, 27}, outside_{10, 10};
  TemporaryFolder folder_;
  Shot shot_;
};

TEST_F(CompositeJobTest, MasksCutTheForegroundOutWithTheirGreys) {
  give_masks();
  const ViewPicture frame = drawn();
  EXPECT_NEAR(frame.alpha(inside_), 1, 0.01);
  EXPECT_NEAR(frame.bgr(inside_)[1], 0.5, 0.02);
  EXPECT_NEAR(frame.alpha(rim_), 0.5, 0.06);
  EXPECT_NEAR(frame.bgr(rim_)[1], 0.25, 0.04) << "premultiplied";
  EXPECT_NEAR(frame.alpha(outside_), 0, 0.01);
  EXPECT_NEAR(frame.bgr(outside_)[1], 0, 0.01);
}

TEST_F(CompositeJobTest, ForegroundStandsOverTheSet) {
  give_masks();
  give_set({kWidth, kHeight}, 8);
  const ViewPicture frame = drawn();
  EXPECT_NEAR(frame.bgr(inside_)[2], 0.5, 0.02);
  EXPECT_NEAR(frame.bgr(rim_)[0], 0.5, 0.04) << "half grey over half of the blue";
  EXPECT_NEAR(frame.bgr(rim_)[2], 0.25, 0.04);
  EXPECT_NEAR(frame.bgr(outside_)[0], 0.5, 0.01);
  EXPECT_NEAR(frame.bgr(outside_)[2], 0, 0.01);
  EXPECT_EQ(frame.alpha(rim_), 1);
  EXPECT_NEAR(frame.z(inside_), 4, 0.05);
  EXPECT_NEAR(frame.z(outside_), 8, 0.05);
}

TEST_F(CompositeJobTest, ASetInFrontHidesTheForeground) {
  give_masks();
  give_set({kWidth, kHeight}, 2);
  EXPECT_NEAR(drawn().bgr(inside_)[2], 0, 0.01);
}

TEST_F(CompositeJobTest, ASetWithoutAFrameIsAnErrorThatNamesIt) {
  give_masks();
  give_set({kWidth, kHeight}, 8);
  fs::remove(folder_.path() / "set/frame.000001.exr");
  expect_error([&] { split(); }, {"shot.toml:22", "names set", "no frame.000001.exr", "expected one for each frame"});
}

TEST_F(CompositeJobTest, ASetOfAnotherSizeIsAnErrorWithBothSizes) {
  give_masks();
  give_set({kWidth / 2, kHeight}, 8);
  expect_error([&] { drawn(); }, {"frame.000000.exr", "is 48x54 px", "expected 96x54"});
}

TEST_F(CompositeJobTest, WhatAMatteNeedsIsAskedForBeforeAnythingRuns) {
  option("over", "set");
  expect_error([&] { RenderJob::check(shot_); }, {"shot.toml:21", "needs matte"});
  option("matte", "mask");
  expect_error([&] { RenderJob::check(shot_); }, {"shot.toml:10: camera 'cam0'", "has no mask", "render 'r'"});
  option("matte", "key");
  expect_error([&] { RenderJob::check(shot_); }, {"shot.toml:10: camera 'cam0' key_color"});
  for (ShotCamera& camera : shot_.cameras) camera.key_color = "#00ff00";
  EXPECT_NO_THROW(RenderJob::check(shot_));
}

}  // namespace
}  // namespace vantage
