#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <opencv2/imgcodecs.hpp>

#include "jobs/encode/encode_job.h"
#include "jobs/encode/film.h"
#include "jobs/encode/layout.h"
#include "jobs/job_context.h"
#include "jobs/views/frame_disparity.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/program.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

namespace fs = std::filesystem;

/// Picture k of a film: a bar that moves to the right.
cv::Mat moving_bar(std::size_t k, cv::Size size) {
  cv::Mat3b picture(size, cv::Vec3b(40, 80, 120));
  picture.colRange(4 * static_cast<int>(k), 4 * static_cast<int>(k) + 8).setTo(cv::Scalar(230, 30, 30));
  return picture;
}

/// What ffprobe says of the first stream.
std::string probe(const fs::path& film, const std::string& entries) {
  const fs::path out = film.string() + ".probe";
  EXPECT_EQ(run_program({"ffprobe", "-v", "error", "-select_streams", "v:0", "-show_entries", "stream=" + entries,
                         "-of", "default=nw=1:nk=1", film.string()},
                        {.stdout_file = out, .stderr_file = {}}),
            0);
  std::string text = read_file(out);
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// Pictures of a film, decoded by the ffmpeg program.
std::vector<cv::Mat> frames_of(const fs::path& film) {
  const fs::path folder = film.string() + ".frames";
  fs::create_directories(folder);
  const ProgramOptions quiet{.stdout_file = {}, .stderr_file = folder / "log"};
  EXPECT_EQ(
      run_program({"ffmpeg", "-nostdin", "-i", film.string(), "-vsync", "passthrough", (folder / "%03d.png").string()},
                  quiet),
      0);
  std::vector<cv::Mat> frames;
  for (int k = 1; fs::exists(folder / fmt::format("{:03d}.png", k)); ++k)
    frames.push_back(cv::imread((folder / fmt::format("{:03d}.png", k)).string()));
  return frames;
}

TEST(Film, HasEveryFrameAtEvenSizeInOrder) {
  const TemporaryFolder folder;
  const fs::path mp4 = folder.path() / "bars.mp4";
  write_film(
      mp4, 7,
      [](std::size_t k) {
        return moving_bar(k, {65, 49});
      },
      {.fps = 25}, folder.path() / "log");
  const std::vector<cv::Mat> frames = frames_of(mp4);
  ASSERT_EQ(frames.size(), 7U);
  for (int k = 0; k < 7; ++k) {
    const cv::Mat& frame = frames[static_cast<std::size_t>(k)];
    EXPECT_EQ(frame.size(), cv::Size(66, 50));
    EXPECT_GT(frame.at<cv::Vec3b>(24, 4 * k + 4)[0], 180);  // the blue bar is where this frame has it
  }
  EXPECT_EQ(probe(mp4, "codec_name,r_frame_rate"), "h264 25/1 ");
}

TEST(Film, SaysWhatItsColoursMean) {
  const TemporaryFolder folder;
  const fs::path mp4 = folder.path() / "bars.mp4";
  write_film(
      mp4, 2,
      [](std::size_t k) {
        return moving_bar(k, {64, 48});
      },
      {.frame_packing = 3}, folder.path() / "log");
  EXPECT_EQ(probe(mp4, "pix_fmt,color_range,color_space,color_transfer,color_primaries"),
            "yuv420p tv bt709 iec61966-2-1 bt709 ");
}

/// A ramp that 8 bits cannot show.
cv::Mat ramp(std::size_t) {
  cv::Mat3w picture(48, 64);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) picture(y, x) = cv::Vec3w::all(static_cast<ushort>(20000 + 64 * (x + 64 * (y / 16))));
  return picture;
}

TEST(Film, TenBitsAndProResAreWhatTheySay) {
  const TemporaryFolder folder;
  const fs::path deep = folder.path() / "deep.mp4", prores = folder.path() / "edit.mov",
                 plain = folder.path() / "plain.mp4";
  write_film(deep, 3, ramp, {.bits = 10, .crf = 4}, folder.path() / "log");
  write_film(prores, 3, ramp, {.codec = "prores"}, folder.path() / "log");
  write_film(plain, 3, ramp, {.crf = 4}, folder.path() / "log");
  EXPECT_EQ(probe(deep, "profile,pix_fmt"), "High 10 yuv420p10le ");
  EXPECT_EQ(probe(prores, "codec_name,profile,pix_fmt,color_space"), "prores HQ yuv422p10le bt709 ");
  EXPECT_EQ(probe(plain, "profile,pix_fmt"), "High yuv420p ");
}

TEST(Film, IsTheSameBytesEachTime) {
  const TemporaryFolder folder;
  for (const char* name : {"a.mp4", "b.mp4"})
    write_film(
        folder.path() / name, 5,
        [](std::size_t k) {
          return moving_bar(k, {64, 48});
        },
        {}, folder.path() / "log");
  EXPECT_EQ(read_file(folder.path() / "a.mp4"), read_file(folder.path() / "b.mp4"));
}

TEST(Film, WithoutFramesOrWithOddOnesIsAnError) {
  const TemporaryFolder folder;
  EXPECT_THROW(write_film(folder.path() / "a.mp4", 0, ramp, {}, folder.path() / "log"), Error);
  const auto growing = [](std::size_t k) { return moving_bar(0, {64, k == 3 ? 50 : 48}); };
  EXPECT_THROW(write_film(folder.path() / "a.mp4", 5, growing, {}, folder.path() / "log"), Error);
}

TEST(Film, AnEncoderThatFailsIsAnErrorWithItsWords) {
  const TemporaryFolder folder;
  try {
    write_film(
        folder.path() / "no_such_folder" / "a.mp4", 500,
        [](std::size_t) {
          return moving_bar(0, {640, 480});
        },
        {}, folder.path() / "log");
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("No such file"), std::string::npos) << e.what();
  }
}

TEST(Layout, PutsEyesWhereItsNameSays) {
  const cv::Mat left = cv::Mat3b(20, 30, cv::Vec3b(1, 1, 1)), right = cv::Mat3b(20, 30, cv::Vec3b(9, 9, 9));
  const auto at = [](const cv::Mat& m, int x, int y) { return static_cast<int>(m.at<cv::Vec3b>(y, x)[0]); };
  for (const auto& [layout, size] : std::map<std::string, cv::Size>{{"side_by_side", {60, 20}},
                                                                    {"side_by_side_half", {30, 20}},
                                                                    {"over_under", {30, 40}},
                                                                    {"over_under_half", {30, 20}}}) {
    const cv::Mat both = lay_out(left, right, layout);
    EXPECT_EQ(both.size(), size) << layout;
    EXPECT_EQ(at(both, 0, 0), 1) << layout;
    EXPECT_EQ(at(both, size.width - 1, size.height - 1), 9) << layout;
  }
  EXPECT_EQ(at(lay_out(left, right, "right"), 3, 3), 9);
}

TEST(Anaglyph, KeepsGreyAndSeparatesTheEyes) {
  const cv::Mat3b grey(4, 4, cv::Vec3b(128, 128, 128)), black(4, 4, cv::Vec3b(0, 0, 0)),
      white(4, 4, cv::Vec3b(255, 255, 255));
  const auto pixel = [](const cv::Mat3b& left, const cv::Mat3b& right) {
    return cv::Mat3b(anaglyph(left, right))(0, 0);
  };
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(pixel(grey, grey)[c], 128, 3);
  EXPECT_GT(pixel(white, black)[2], 240);  // left eye is red
  EXPECT_LT(pixel(white, black)[0], 10);
  EXPECT_LT(pixel(black, white)[2], 10);  // right eye is cyan
  EXPECT_GT(pixel(black, white)[0], 240);
}

/// Two stereo frames, the second one outside the depth budget.
JobContext::Config stereo_job(const fs::path& folder) {
  JobContext::Config config;
  config.unit = {{"name", "shot"},           {"fps", 30.0},
                 {"stereo", true},           {"jobs", {"render/shot/000000", "render/shot/000003"}},
                 {"frames", {0, 3}},         {"crossed_percent", 1.0},
                 {"uncrossed_percent", 2.0}, {"see_through", false}};
  FrameDisparity disparity{
      .nearest_percent = -0.5, .farthest_percent = 1.5, .p0_1_percent = -0.5, .p99_9_percent = 1.5};
  for (const char* job : {"render/shot/000000", "render/shot/000003"}) {
    config.inputs[job] = folder / job;
    fs::create_directories(config.inputs[job]);
    cv::imwrite((config.inputs[job] / "frame.png").string(), cv::Mat4b(48, 128, cv::Vec4b(10, 100, 200, 255)));
    write_frame_disparity(config.inputs[job] / "disparity.json", disparity);
    disparity.p0_1_percent = -5;
    disparity.too_near_share = 0.2;
    disparity.cut_left_share = 0.5;
    disparity.cut_percent = 4.2;
  }
  config.out_dir = folder / "out";
  config.scratch_dir = folder / "scratch";
  fs::create_directories(config.scratch_dir);
  return config;
}

TEST(EncodeJob, StereoMakesTheFilmsAskedFor) {
  const TemporaryFolder folder;
  JobContext context(stereo_job(folder.path()));
  EncodeJob::Params params;
  params.stereo = {"side_by_side", "side_by_side_half", "over_under", "anaglyph", "left"};
  EncodeJob::run(context, params);
  EXPECT_EQ(context.figures().at("frames"), 2);
  const auto size_of = [&](const char* file) { return frames_of(folder.path() / "out" / file).at(0).size(); };
  EXPECT_EQ(size_of("shot.mp4"), cv::Size(128, 48));
  EXPECT_FALSE(fs::exists(folder.path() / "out" / "side_by_side.mp4")) << "is the film itself, by another name";
  EXPECT_EQ(size_of("side_by_side_half.mp4"), cv::Size(64, 48));
  EXPECT_EQ(size_of("over_under.mp4"), cv::Size(64, 96));
  EXPECT_EQ(size_of("anaglyph.mp4"), cv::Size(64, 48));
  EXPECT_EQ(size_of("left.mp4"), cv::Size(64, 48));
}

TEST(EncodeJob, SaysWhichFramesLeaveTheDepthBudgetAndWhatToChange) {
  const TemporaryFolder folder;
  JobContext context(stereo_job(folder.path()));
  EncodeJob::run(context, {});
  const Json& budget = context.figures().at("depth_budget");
  EXPECT_EQ(budget.at("frames_outside_budget"), 1);
  EXPECT_EQ(budget.at("nearest_percent"), -5);
  const auto warnings = context.figures().at("warnings").get<std::vector<std::string>>();
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_NE(warnings[0].find("1 of 2 frames (3)"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[0].find("0.46 times the baseline"), std::string::npos) << warnings[0];  // 3 / 6.5
  EXPECT_NE(warnings[1].find("floating_window_percent = 4.2"), std::string::npos) << warnings[1];
  EXPECT_EQ(read_json(folder.path() / "out" / "depth_budget.json").at("frames").at(1).at("frame"), 3);
  EXPECT_FALSE(cv::imread((folder.path() / "out" / "depth_budget.png").string()).empty());
}

}  // namespace
}  // namespace vantage
