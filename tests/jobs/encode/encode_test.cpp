#include <fmt/format.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "jobs/encode/encode_job.h"
#include "jobs/encode/film.h"
#include "jobs/job_context.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/program.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> moving_bars(const fs::path& folder, int count, cv::Size size) {
  std::vector<fs::path> pictures;
  for (int k = 0; k < count; ++k) {
    cv::Mat4b picture(size, cv::Vec4b(40, 80, 120, 255));
    picture.colRange(4 * k, 4 * k + 8).setTo(cv::Scalar(230, 30, 30, 255));
    pictures.push_back(folder / ("p" + std::to_string(k) + ".png"));
    cv::imwrite(pictures.back().string(), picture);
  }
  return pictures;
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
  write_film(mp4, moving_bars(folder.path(), 7, {65, 49}), {.fps = 25}, folder.path() / "scratch");
  const std::vector<cv::Mat> frames = frames_of(mp4);
  ASSERT_EQ(frames.size(), 7U);
  for (int k = 0; k < 7; ++k) {
    const cv::Mat& frame = frames[static_cast<std::size_t>(k)];
    EXPECT_EQ(frame.size(), cv::Size(66, 50));
    EXPECT_GT(frame.at<cv::Vec3b>(24, 4 * k + 4)[0], 180);  // the blue bar is where this frame has it
  }
}

TEST(Film, IsTheSameBytesEachTime) {
  const TemporaryFolder folder;
  const auto pictures = moving_bars(folder.path(), 5, {64, 48});
  write_film(folder.path() / "a.mp4", pictures, {}, folder.path() / "s1");
  write_film(folder.path() / "b.mp4", pictures, {}, folder.path() / "s2");
  EXPECT_EQ(read_file(folder.path() / "a.mp4"), read_file(folder.path() / "b.mp4"));
}

TEST(Film, WithoutFramesIsAnError) {
  const TemporaryFolder folder;
  EXPECT_THROW(write_film(folder.path() / "a.mp4", {}, {}, folder.path() / "s"), Error);
}

TEST(Anaglyph, KeepsGreyAndSeparatesTheEyes) {
  const cv::Mat3b grey(4, 4, cv::Vec3b(128, 128, 128)), black(4, 4, cv::Vec3b(0, 0, 0)),
      white(4, 4, cv::Vec3b(255, 255, 255));
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(anaglyph(grey, grey)(0, 0)[c], 128, 3);
  EXPECT_GT(anaglyph(white, black)(0, 0)[2], 240);  // left eye is red
  EXPECT_LT(anaglyph(white, black)(0, 0)[0], 10);
  EXPECT_LT(anaglyph(black, white)(0, 0)[2], 10);  // right eye is cyan
  EXPECT_GT(anaglyph(black, white)(0, 0)[0], 240);
}

TEST(EncodeJob, StereoMakesThreeFilms) {
  const TemporaryFolder folder;
  JobContext::Config config;
  config.unit = {
      {"name", "shot"}, {"fps", 30.0}, {"stereo", true}, {"frames", {"render/shot/000000", "render/shot/000003"}}};
  for (const char* job : {"render/shot/000000", "render/shot/000003"}) {
    config.inputs[job] = folder.path() / job;
    fs::create_directories(config.inputs[job]);
    cv::imwrite((config.inputs[job] / "frame.png").string(), cv::Mat4b(48, 128, cv::Vec4b(10, 100, 200, 255)));
  }
  config.out_dir = folder.path() / "out";
  config.scratch_dir = folder.path() / "scratch";
  fs::create_directories(config.scratch_dir);
  JobContext context(config);
  EncodeJob::run(context, {});
  EXPECT_EQ(context.figures().at("frames"), 2);
  const auto width_of = [&](const char* file) { return frames_of(config.out_dir / file).at(0).cols; };
  EXPECT_EQ(width_of("shot.mp4"), 128);
  EXPECT_EQ(width_of("side_by_side.mp4"), 128);
  EXPECT_EQ(width_of("anaglyph.mp4"), 64);
}

}  // namespace
}  // namespace vantage
