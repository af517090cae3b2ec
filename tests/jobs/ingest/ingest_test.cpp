#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "jobs/ingest/audio.h"
#include "jobs/ingest/footage.h"
#include "jobs/ingest/ingest_job.h"
#include "jobs/ingest/probe.h"
#include "schema/base/error.h"
#include "schema/formats/exr.h"
#include "schema/formats/frame_table.h"
#include "tests/jobs/ingest/ingest_shot.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

TEST_F(Ingest, VariableFrameRateKeepsPresentationTimes) {
  write_stills(12);
  // Times in ms that no constant rate explains; B-frames shuffle the packets.
  const std::vector<int> times_ms{0, 40, 80, 200, 240, 280, 400, 440, 480, 600, 640, 720};
  std::ofstream list(folder_ / "list.txt");
  for (std::size_t k = 0; k < times_ms.size(); ++k)
    list << fmt::format("file 'still{:03d}.png'\nduration {}\n", k,
                        k + 1 < times_ms.size() ? (times_ms[k + 1] - times_ms[k]) / 1000.0 : 0.04);
  list.close();
  for (const char* name : {"vfr.mp4", "vfr.mkv"}) {
    ffmpeg({"-f", "concat", "-i", (folder_ / "list.txt").string(), "-vsync", "vfr", "-enc_time_base", "1/1000", "-c:v",
            "libx264", "-crf", "5", "-pix_fmt", "yuv420p", "-bf", "2"},
           folder_ / name);
    run({folder_ / name}, Json::object());
    ASSERT_EQ(table().num_frames(), 12) << name;
    for (std::size_t k = 0; k < times_ms.size(); ++k) {
      EXPECT_NEAR(table().pts_s[k], times_ms[k] / 1000.0, 0.0011) << name << " frame " << k;
      EXPECT_EQ(number_of(cv::imread(frame_path(folder_ / "out", static_cast<int>(k)).string())), static_cast<int>(k))
          << name;
    }
  }
}

TEST_F(Ingest, StillsAreIndexOverFps) {
  write_stills(5);
  run(footage_files(folder_, "still*.png"), {{"fps", 12.5}});
  EXPECT_EQ(table().camera, "left");
  EXPECT_EQ(table().width, 96);
  ASSERT_EQ(table().num_frames(), 5);
  for (int k = 0; k < 5; ++k) {
    EXPECT_DOUBLE_EQ(table().pts_s[static_cast<std::size_t>(k)], k / 12.5);
    EXPECT_EQ(number_of(cv::imread(frame_path(folder_ / "out", k).string())), k);
  }
  EXPECT_FALSE(fs::exists(folder_ / "out/audio.json"));
  EXPECT_TRUE(fs::exists(folder_ / "out/preview.jpg"));
}

TEST_F(Ingest, LinearExrBecomesSrgb) {
  Channels channels;
  for (const char* name : {"R", "G", "B"}) channels[name] = {64, 64, std::vector<float>(64 * 64, 0.5F)};
  channels["R"].values.assign(64 * 64, 4.0F);
  write_exr(folder_ / "a.exr", {{"", channels, {}}});
  const cv::Mat bgr = read_still(folder_ / "a.exr");
  EXPECT_EQ(bgr.at<cv::Vec3w>(9, 9), cv::Vec3w(48192, 48192, 65535));  // 0.735357 of the range
}

TEST_F(Ingest, TruncatedVideoIsUsedAsFarAsItGoes) {
  const fs::path whole = make_video("whole.mp4", 30, {"-g", "5"});
  fs::copy_file(whole, folder_ / "cut.mp4");
  fs::resize_file(folder_ / "cut.mp4", fs::file_size(whole) * 3 / 4);
  const Json figures = run({folder_ / "cut.mp4"}, Json::object());
  const int num = table().num_frames();
  EXPECT_GT(num, 3);
  EXPECT_LT(num, 30);
  ASSERT_TRUE(figures.contains("warnings"));
  EXPECT_EQ(figures["warnings"][0], fmt::format("footage is truncated: {} of 30 frames are used", num));
  for (int k = 0; k < num; ++k) EXPECT_NEAR(table().pts_s[static_cast<std::size_t>(k)], k / 25.0, 1e-5);
}

TEST_F(Ingest, WholeVideoWarnsOfNothing) {
  EXPECT_FALSE(run({make_video("whole.mp4", 30)}, Json::object()).contains("warnings"));
  EXPECT_EQ(table().num_frames(), 30);
}

TEST_F(Ingest, DeclaredRateOfAVideoReplacesItsOwn) {
  const Json figures = run({make_video("whole.mp4", 10)}, {{"fps", 50.0}});
  EXPECT_DOUBLE_EQ(table().pts_s[9], 9 / 50.0);
  EXPECT_EQ(figures["warnings"][0], "shot.toml says 50 fps, the footage 25: 50 is used");
}

TEST_F(Ingest, SoundEnvelopeStartsWithTheFirstPicture) {
  write_stills(25);
  // Silence but for a tone from 0.5 s to 0.6 s; once as is, once with the sound's track 0.2 s late.
  for (const double late_s : {0.0, 0.2}) {
    const fs::path video = folder_ / "sound.mkv";
    ffmpeg({"-framerate", "25", "-i", (folder_ / "still%03d.png").string(), "-itsoffset", std::to_string(late_s), "-f",
            "lavfi", "-i", "aevalsrc='0.5*sin(2*PI*1000*t)*between(t,0.5,0.6)':d=1", "-c:v", "libx264", "-c:a",
            "pcm_s16le"},
           video);
    const auto rms = audio_envelope(video, 0, folder_ / "scratch");
    ASSERT_GE(rms.size(), 95U);
    const auto loud_from = static_cast<std::size_t>(std::lround((0.5 + late_s) * 100));
    for (std::size_t k = 0; k < rms.size(); ++k)
      EXPECT_NEAR(rms[k], k >= loud_from && k < loud_from + 10 ? 0.5 / std::sqrt(2) : 0.0, 0.01)
          << "late " << late_s << " value " << k;
  }
}

TEST_F(Ingest, SaysWhatIsWrongWithFootage) {
  EXPECT_NE(error_of({folder_ / "gone.mp4"}).find("gone.mp4: does not exist"), std::string::npos);
  std::ofstream(folder_ / "text.mp4") << std::string(5000, 'x');
  EXPECT_NE(error_of({folder_ / "text.mp4"}).find("is not a video"), std::string::npos);
  std::ofstream(folder_ / "empty.mp4").close();
  EXPECT_NE(error_of({folder_ / "empty.mp4"}).find("empty.mp4: is empty (0 bytes), expected a video"),
            std::string::npos);
  std::ofstream(folder_ / "empty.png").close();
  EXPECT_NE(error_of({folder_ / "empty.png"}).find("empty.png: is empty"), std::string::npos);
  ffmpeg({"-f", "lavfi", "-i", "sine=d=0.2"}, folder_ / "sound.mp4");
  EXPECT_NE(error_of({folder_ / "sound.mp4"}).find("sound.mp4: has no picture track"), std::string::npos);
  std::ofstream(folder_ / "text.png") << "no picture";
  EXPECT_NE(error_of({folder_ / "text.png"}).find("is not a picture"), std::string::npos);
  cv::imwrite((folder_ / "tiny.png").string(), picture(1, {16, 64}));
  EXPECT_NE(error_of({folder_ / "tiny.png"}).find("is 16x64 px, expected at least 64x64"), std::string::npos);
  cv::imwrite((folder_ / "a.png").string(), picture(1, {96, 64}));
  cv::imwrite((folder_ / "b.png").string(), picture(1, {64, 96}));
  EXPECT_NE(error_of({folder_ / "a.png", folder_ / "b.png"}).find("b.png: is 64x96 px, expected 96x64"),
            std::string::npos);
}

TEST_F(Ingest, ProbeTellsWhatFootageIs) {
  const FootageProbe video = probe_footage(make_video("whole.mp4", 30).string());
  EXPECT_EQ(video.width, 96);
  EXPECT_EQ(video.num_frames, 30);
  EXPECT_NEAR(video.fps, 25, 1e-9);
  EXPECT_NEAR(video.duration_s, 1.2, 1e-3);
  EXPECT_TRUE(video.warnings.empty());
  const FootageProbe stills = probe_footage((folder_ / "still*.png").string());
  EXPECT_TRUE(stills.is_stills);
  EXPECT_EQ(stills.num_frames, 30);
  EXPECT_THROW(probe_footage((folder_ / "none*.png").string()), Error);
}

TEST_F(Ingest, SplitNamesTheLineOfMissingFootage) {
  Shot shot;
  shot.folder = folder_;
  ShotCamera left;
  left.name = "left", left.footage = "a/cam?/*.png", left.fps = 2, left.line = 7;
  shot.cameras = {left};
  const auto split = [&] {
    return IngestJob::split(ShotState(shot, [](const std::string&) { return std::nullopt; }), {});
  };
  try {
    split();
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(std::string(e.what()),
              (folder_ / "shot.toml").string() + ":7: camera 'left' names a/cam?/*.png, which matches no file");
  }
  fs::create_directories(folder_ / "a/cam1");
  for (const char* name : {"b.png", "a.png", "c.png"}) cv::imwrite((folder_ / "a/cam1" / name).string(), picture(1));
  const auto units = split();
  ASSERT_EQ(units.size(), 1U);
  EXPECT_EQ(units[0].name, "ingest/left");
  EXPECT_EQ(units[0].unit, (Json{{"camera", "left"}, {"stills", true}, {"fps", 2.0}}));
  ASSERT_EQ(units[0].sources.size(), 3U);
  EXPECT_EQ(units[0].sources[1].path, folder_ / "a/cam1/b.png");
}

TEST(TimeStamps, StampsThatDoNotRiseAreReplaced) {
  const std::vector<std::optional<double>> told{0.0, 0.04, 0.04, 0.12, std::nullopt, 9.0, 0.24, 0.28, std::nullopt};
  const TimeStamps times = time_stamps(told, 25);
  const std::vector<double> expected{0, 0.04, 0.08, 0.12, 0.16, 0.20, 0.24, 0.28, 0.32};
  for (std::size_t k = 0; k < expected.size(); ++k) EXPECT_NEAR(times.pts_s[k], expected[k], 1e-12) << k;
  EXPECT_EQ(times.num_guessed, 4);
}

TEST(TimeStamps, RateCountsWhereNothingTells) {
  const TimeStamps times = time_stamps(std::vector<std::optional<double>>(3), 25);
  EXPECT_EQ(times.num_guessed, 3);
  EXPECT_NEAR(times.pts_s[2], 0.08, 1e-12);
}

TEST(TimeStamps, GapDoesNotSpoilTheNominalRate) {
  const std::vector<std::optional<double>> told{0.0, 0.04, 0.08, 2.0, 2.04, 2.08};
  const TimeStamps times = time_stamps(told, 6 / 2.12);
  EXPECT_NEAR(times.fps, 25, 1e-9);
  EXPECT_EQ(gaps_in(times.pts_s), std::vector<std::string>{"no picture from 0.080 s to 2.000 s (after frame 2)"});
}

TEST(TimeStamps, DeclaredRateDoesNotFlattenAVariableOne) {
  TimeStamps times{.fps = 25, .pts_s = {0, 0.04, 0.2, 0.24}, .num_guessed = 0};
  EXPECT_NE(declare_fps(times, 30).find("varies"), std::string::npos);
  EXPECT_EQ(times.pts_s[2], 0.2);
}

}  // namespace
}  // namespace vantage
