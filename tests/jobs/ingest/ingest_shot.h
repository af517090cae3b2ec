#pragma once
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "jobs/ingest/ingest_job.h"
#include "schema/base/error.h"
#include "schema/base/program.h"
#include "schema/formats/frame_table.h"

namespace vantage {
namespace fs = std::filesystem;

/// Makes footage with ffmpeg and runs the job on it.
class Ingest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              fmt::format("ingest-{}-{}", getpid(), testing::UnitTest::GetInstance()->random_seed());
    fs::create_directories(folder_ / "scratch");
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Numbered pictures: the left half's brightness tells the number.
  cv::Mat picture(int number, cv::Size size = {96, 64}) const {
    cv::Mat bgr(size, CV_8UC3, cv::Scalar(40, 80, 160));
    bgr.colRange(0, size.width / 2).setTo(cv::Scalar::all(8 * number));
    return bgr;
  }
  int number_of(const cv::Mat& bgr) const { return (bgr.at<cv::Vec3b>(bgr.rows / 2, bgr.cols / 4)[1] + 4) / 8; }

  void ffmpeg(std::vector<std::string> words, const fs::path& out) {
    words.insert(words.begin(), {"ffmpeg", "-v", "error", "-nostdin", "-y"});
    words.push_back(out.string());
    ASSERT_EQ(run_program(words, {}), 0);
  }
  void write_stills(int num) {
    for (int k = 0; k < num; ++k) cv::imwrite((folder_ / fmt::format("still{:03d}.png", k)).string(), picture(k));
  }
  /// Video of constant rate from num stills.
  fs::path make_video(const std::string& name, int num, std::vector<std::string> more = {}) {
    write_stills(num);
    std::vector<std::string> words{"-framerate", "25", "-i", (folder_ / "still%03d.png").string()};
    words.insert(words.end(), more.begin(), more.end());
    words.insert(words.end(),
                 {"-c:v", "libx264", "-crf", "5", "-pix_fmt", "yuv420p", "-bf", "2", "-movflags", "faststart"});
    ffmpeg(words, folder_ / name);
    return folder_ / name;
  }

  /// Whether a warning holds these words.
  static bool warns_of(const Json& figures, const std::string& words) {
    for (const auto& warning : figures.value("warnings", Json::array()))
      if (warning.get<std::string>().find(words) != std::string::npos) return true;
    return false;
  }
  Json run(const std::vector<fs::path>& files, Json unit = Json::object()) {
    fs::remove_all(folder_ / "out");
    unit["camera"] = "left";
    unit["stills"] = is_still(files[0]);
    JobContext::Config config{.unit = unit,
                              .inputs = {},
                              .sources = {},
                              .out_dir = folder_ / "out",
                              .scratch_dir = folder_ / "scratch",
                              .on_progress = {}};
    for (const auto& file : files) config.sources[fmt::format("footage/{:06d}", config.sources.size())] = file;
    fs::create_directories(config.out_dir);
    JobContext context(config);
    IngestJob::run(context, {});
    return context.figures();
  }
  cv::Mat frame(int number) const { return cv::imread(frame_path(folder_ / "out", number).string()); }
  FrameTable table() const { return read_frame_table(folder_ / "out"); }
  std::string error_of(const std::vector<fs::path>& files) {
    try {
      run(files, Json::object());
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::BadInput);
      return e.what();
    }
    return "no error";
  }

  fs::path folder_;
};

}  // namespace vantage
