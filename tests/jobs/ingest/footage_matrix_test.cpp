/// Footage as it comes: every kind is made with ffmpeg and compared with what went into it.
#include <cmath>
#include <fstream>

#include "jobs/ingest/audio.h"
#include "schema/formats/footage_trim.h"
#include "tests/jobs/ingest/ingest_shot.h"

namespace vantage {
namespace {

class FootageMatrix : public Ingest {
 protected:
  /// Numbered pictures, encoded as the words say.
  fs::path make(const std::string& name, int num, const std::vector<std::string>& words) {
    write_stills(num);
    std::vector<std::string> all{"-framerate", "25", "-i", (folder_ / "still%03d.png").string()};
    all.insert(all.end(), words.begin(), words.end());
    ffmpeg(all, folder_ / name);
    return folder_ / name;
  }
  void expect_frames(int num, const std::string& what, double fps = 25, int first_number = 0) {
    ASSERT_EQ(table().num_frames(), num) << what;
    for (int k = 0; k < num; ++k) {
      EXPECT_NEAR(table().pts_s[static_cast<std::size_t>(k)], k / fps, 0.0011) << what << " frame " << k;
      EXPECT_EQ(number_of(frame(k)), k + first_number) << what << " frame " << k;
    }
  }
  static double mean_difference(const cv::Mat& a, const cv::Mat& b) {
    return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total() * static_cast<std::size_t>(a.channels()));
  }
};

TEST_F(FootageMatrix, CodecsAndContainers) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> kinds{
      {"h264.mp4", {"-c:v", "libx264", "-crf", "5", "-bf", "2", "-pix_fmt", "yuv420p"}},
      {"h264.mkv", {"-c:v", "libx264", "-crf", "5", "-bf", "2", "-pix_fmt", "yuv420p"}},
      {"h264.ts", {"-c:v", "libx264", "-crf", "5", "-bf", "2", "-pix_fmt", "yuv420p"}},
      {"h264.avi", {"-c:v", "libx264", "-crf", "5", "-bf", "0", "-pix_fmt", "yuv420p"}},
      {"hevc.mp4", {"-c:v", "libx265", "-crf", "5", "-x265-params", "log-level=error", "-pix_fmt", "yuv420p"}},
      {"mjpeg.avi", {"-c:v", "mjpeg", "-q:v", "2", "-pix_fmt", "yuvj422p"}},
      {"mjpeg.mov", {"-c:v", "mjpeg", "-q:v", "2", "-pix_fmt", "yuvj420p"}},
      {"mpeg4.avi", {"-c:v", "mpeg4", "-q:v", "1", "-bf", "2"}}};
  for (const auto& [name, words] : kinds) {
    EXPECT_FALSE(run({make(name, 9, words)}).contains("warnings")) << name;
    expect_frames(9, name);
  }
}

TEST_F(FootageMatrix, DeepFootageKeepsItsBits) {
  cv::Mat3w ramp(64, 256);
  for (int x = 0; x < ramp.cols; ++x)
    ramp.col(x).setTo(cv::Scalar::all(20000 + 64 * x));  // a quarter of an 8-bit level
  cv::imwrite((folder_ / "ramp.png").string(), ramp);
  const std::vector<std::vector<std::string>> codecs{{"prores.mov", "prores_ks", "yuv444p10le"},
                                                     {"ffv1.mkv", "ffv1", "yuv420p12le"},
                                                     {"ffv1rgb.mkv", "ffv1", "gbrp16le"}};
  for (const auto& codec : codecs) {
    ffmpeg({"-i", (folder_ / "ramp.png").string(), "-c:v", codec[1], "-pix_fmt", codec[2]}, folder_ / codec[0]);
    EXPECT_FALSE(run({folder_ / codec[0]}).contains("warnings")) << codec[0];
    const cv::Mat kept = cv::imread(frame_path(folder_ / "out", 0).string(), cv::IMREAD_UNCHANGED);
    ASSERT_EQ(kept.type(), CV_16UC3) << codec[0];
    for (int x = 8; x < 248; ++x)
      EXPECT_NEAR(kept.at<cv::Vec3w>(32, x)[1], ramp(32, x)[1], 100) << codec[0] << " " << x;
  }
}

TEST_F(FootageMatrix, TimeStampsThatStartLateStartAtZero) {
  run({make("late.mkv", 6, {"-c:v", "libx264", "-crf", "5", "-bf", "2", "-output_ts_offset", "7.3"})});
  expect_frames(6, "late");
}

TEST_F(FootageMatrix, EditListHidesPicturesAndSoundStaysWithThem) {
  write_stills(25);
  // A tone from 0.6 s on; then 0.48 s are cut off the front by an edit list, without encoding anew.
  ffmpeg({"-framerate", "25", "-i", (folder_ / "still%03d.png").string(), "-f", "lavfi", "-i",
          "aevalsrc='0.5*sin(2*PI*1000*t)*gte(t,0.6)':d=1:s=48000", "-c:v", "libx264", "-crf", "5", "-bf", "2", "-c:a",
          "aac"},
         folder_ / "whole.mp4");
  ffmpeg({"-ss", "0.48", "-i", (folder_ / "whole.mp4").string(), "-c", "copy"}, folder_ / "cut.mp4");
  EXPECT_FALSE(run({folder_ / "cut.mp4"}).contains("warnings"));
  expect_frames(13, "edit list", 25, 12);
  const auto rms = read_json(folder_ / "out/audio.json").at("rms").get<std::vector<double>>();
  const auto loud = std::find_if(rms.begin(), rms.end(), [](double v) { return v > 0.18; });
  EXPECT_NEAR(static_cast<double>(loud - rms.begin()) / kEnvelopeRateHz, 0.12, 0.025);
}

TEST_F(FootageMatrix, RotationNotedInTheFileIsApplied) {
  cv::Mat corner(64, 96, CV_8UC3, cv::Scalar::all(20));
  corner(cv::Rect(0, 0, 32, 32)).setTo(cv::Scalar::all(220));
  cv::imwrite((folder_ / "corner.png").string(), corner);
  ffmpeg({"-loop", "1", "-t", "0.12", "-i", (folder_ / "corner.png").string(), "-c:v", "libx264", "-crf", "5",
          "-pix_fmt", "yuv420p"},
         folder_ / "plain.mp4");
  // ffmpeg writes a display matrix that turns by so much counter-clockwise; where the top left corner comes to lie.
  const std::vector<std::pair<int, cv::Point>> turns{{90, {0, 95}}, {180, {95, 63}}, {270, {63, 0}}};
  for (const auto& [degrees, place] : turns) {
    ffmpeg({"-i", (folder_ / "plain.mp4").string(), "-c", "copy", "-metadata:s:v", fmt::format("rotate={}", degrees)},
           folder_ / "turned.mp4");
    run({folder_ / "turned.mp4"});
    const cv::Size size = degrees == 180 ? cv::Size(96, 64) : cv::Size(64, 96);
    ASSERT_EQ(frame(0).size(), size) << degrees;
    EXPECT_EQ(cv::Size(table().width, table().height), size);
    const cv::Point inside((place.x + size.width / 2) / 2, (place.y + size.height / 2) / 2);
    EXPECT_GT(frame(0).at<cv::Vec3b>(inside)[1], 200) << degrees;
    EXPECT_LT(cv::mean(frame(0))[1], 70);
  }
}

TEST_F(FootageMatrix, ColoursAreThoseThatWentInWhateverTheMatrixAndRange) {
  cv::Mat bars(64, 96, CV_8UC3);
  const std::vector<cv::Vec3b> colours{{30, 30, 200},  {30, 200, 30},   {200, 30, 30},
                                       {30, 160, 220}, {200, 200, 200}, {20, 20, 20}};
  for (int x = 0; x < 96; ++x) bars.col(x).setTo(colours[static_cast<std::size_t>(x / 16)]);
  cv::imwrite((folder_ / "bars.png").string(), bars);
  const auto encode = [&](const std::string& name, const std::string& matrix, const std::string& range, bool tagged,
                          const std::string& size) {
    std::vector<std::string> words{
        "-loop",    "1",
        "-t",       "0.08",
        "-i",       (folder_ / "bars.png").string(),
        "-vf",      fmt::format("scale={}:out_color_matrix={}:out_range={}:flags=neighbor", size, matrix, range),
        "-c:v",     "libx264",
        "-crf",     "1",
        "-pix_fmt", "yuv444p"};
    // setparams would be the same; these are the stream's own tags.
    if (tagged)
      words.insert(words.end(), {"-colorspace", matrix == "bt601"    ? "smpte170m"
                                                : matrix == "bt2020" ? "bt2020nc"
                                                                     : matrix});
    words.insert(words.end(), {"-color_range", range});
    ffmpeg(words, folder_ / name);
    return folder_ / name;
  };
  for (const char* matrix : {"bt601", "bt709", "bt2020"})
    for (const char* range : {"tv", "pc"}) {
      run({encode("tagged.mp4", matrix, range, true, "96:64")});
      EXPECT_LT(mean_difference(frame(0), bars), 2.0) << matrix << ' ' << range;
    }
  run({encode("sd.mp4", "bt601", "tv", false, "96:64")});
  EXPECT_LT(mean_difference(frame(0), bars), 2.0) << "untagged SD is BT.601";
  const Json figures = run({encode("hd.mp4", "bt709", "tv", false, "1152:768")});
  cv::Mat large(768, 1152, CV_8UC3);
  for (int x = 0; x < 1152; ++x) large.col(x).setTo(colours[static_cast<std::size_t>(x / 192)]);
  EXPECT_LT(mean_difference(frame(0), large), 2.0) << "untagged HD is BT.709";
  EXPECT_EQ(figures["footage"], "h264, 8 bit, matrix bt709 (assumed)");
}

TEST_F(FootageMatrix, AnamorphicPixelsBecomeSquare) {
  const Json wide =
      run({make("wide.mp4", 3, {"-c:v", "libx264", "-crf", "5", "-vf", "setsar=4/3", "-pix_fmt", "yuv420p"})});
  EXPECT_EQ(frame(0).size(), cv::Size(128, 64));
  EXPECT_TRUE(warns_of(wide, "not square (4:3"));
  run({make("high.mp4", 3, {"-c:v", "libx264", "-crf", "5", "-vf", "setsar=2/3", "-pix_fmt", "yuv420p"})});
  EXPECT_EQ(frame(0).size(), cv::Size(96, 96));
}

TEST_F(FootageMatrix, InterlacedFootageIsDeinterlacedAndSaid) {
  // A bar that moves 8 px per field: woven fields show a comb, rows that differ from both neighbours.
  ffmpeg(
      {"-f", "lavfi", "-i", "color=c=gray:s=96x64:r=50:d=0.4", "-f", "lavfi", "-i", "color=c=white:s=16x64:r=50:d=0.4",
       "-filter_complex", "[0][1]overlay=x='4*n':y=0,interlace=scan=tff:lowpass=0,setfield=tff", "-c:v", "libx264",
       "-flags", "+ildct+ilme", "-crf", "5", "-pix_fmt", "yuv420p"},
      folder_ / "fields.mp4");
  EXPECT_TRUE(warns_of(run({folder_ / "fields.mp4"}), "is interlaced: each picture is deinterlaced"));
  ASSERT_EQ(table().num_frames(), 10);
  cv::Mat grey = cv::imread(frame_path(folder_ / "out", 5).string(), cv::IMREAD_GRAYSCALE), above, below;
  grey(cv::Range(8, 56), cv::Range::all()).convertTo(grey, CV_32F);
  above = grey.rowRange(0, grey.rows - 1), below = grey.rowRange(1, grey.rows);
  EXPECT_LT(cv::norm(above, below, cv::NORM_L1) / static_cast<double>(above.total()), 4.0);
  EXPECT_NEAR(table().pts_s[9], 9 / 25.0, 1e-6);
}

TEST_F(FootageMatrix, GapStaysAGap) {
  write_stills(10);
  std::ofstream list(folder_ / "list.txt");
  for (int k = 0; k < 10; ++k) list << fmt::format("file 'still{:03d}.png'\nduration {}\n", k, k == 4 ? 1.04 : 0.04);
  list.close();
  ffmpeg({"-f", "concat", "-i", (folder_ / "list.txt").string(), "-vsync", "vfr", "-enc_time_base", "1/1000", "-c:v",
          "libx264", "-crf", "5", "-pix_fmt", "yuv420p", "-bf", "2"},
         folder_ / "gap.mkv");
  EXPECT_TRUE(warns_of(run({folder_ / "gap.mkv"}),
                       "the footage has a gap: no picture from 0.160 s to 1.200 s (after frame 4)"));
  ASSERT_EQ(table().num_frames(), 10);
  EXPECT_NEAR(table().pts_s[9], 1.36, 0.0011);
  EXPECT_NEAR(table().fps, 25, 0.1);
}

TEST_F(FootageMatrix, TwoPicturesAtTheSameTimeAreBothKept) {
  // A stream whose packets 3 and 4 carry one time stamp.
  make("plain.mkv", 8, {"-c:v", "mjpeg", "-q:v", "2", "-pix_fmt", "yuvj420p"});
  ffmpeg({"-i", (folder_ / "plain.mkv").string(), "-c", "copy", "-bsf:v", "setts=ts=if(eq(N\\,4)\\,PREV_OUTPTS\\,PTS)"},
         folder_ / "twice.mkv");
  EXPECT_TRUE(warns_of(run({folder_ / "twice.mkv"}), "1 of 8 frames carry no time stamp of their own"));
  expect_frames(8, "twice");
}

TEST_F(FootageMatrix, DamagedMiddleIsSaid) {
  const fs::path whole = make_video("whole.ts", 40, {"-g", "5"});
  std::fstream file(whole, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(static_cast<std::streamoff>(fs::file_size(whole) / 2));
  for (int k = 0; k < 188 * 20; ++k) file.put('x');
  file.close();
  run({whole});
  EXPECT_GT(table().num_frames(), 20);
  for (int k = 1; k < table().num_frames(); ++k)
    EXPECT_GT(table().pts_s[static_cast<std::size_t>(k)], table().pts_s[static_cast<std::size_t>(k) - 1]);
}

TEST_F(FootageMatrix, TrimmedPicturesDoNotExist) {
  const fs::path video = make_video("whole.mp4", 25);
  run({video}, {{"trim_start_s", 0.2}, {"trim_end_s", 0.6}});
  expect_frames(10, "trimmed", 25, 5);
  const FootageTrim trim = read_footage_trim(folder_ / "out");
  EXPECT_EQ(trim.num_before, 5);
  EXPECT_NEAR(trim.start_s, 0.2, 1e-6);
  run({video});
  EXPECT_EQ(table().num_frames(), 25);
  EXPECT_FALSE(fs::exists(folder_ / "out/trim.json"));
  EXPECT_EQ(read_footage_trim(folder_ / "out").num_before, 0);
  try {
    run({video}, {{"trim_start_s", 3.0}});
    FAIL();
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(),
                 "camera 'left': no picture is left between trim_start_s and trim_end_s: its footage has 25 "
                 "pictures up to 0.960 s, expected trim_start_s before that");
  }
}

TEST_F(FootageMatrix, TrimmedStills) {
  write_stills(9);
  run(footage_files(folder_, "still*.png"), {{"fps", 10.0}, {"trim_start_s", 0.2}, {"trim_end_s", 0.5}});
  expect_frames(3, "stills", 10, 2);
}

TEST_F(FootageMatrix, SixteenBitStillsKeepTheirBits) {
  cv::Mat wide;
  picture(5).convertTo(wide, CV_16U, 257, 31);
  for (const char* name : {"wide.png", "wide.tiff"}) {
    cv::imwrite((folder_ / name).string(), wide);
    run({folder_ / name});
    const cv::Mat kept = cv::imread(frame_path(folder_ / "out", 0).string(), cv::IMREAD_UNCHANGED);
    EXPECT_EQ(cv::norm(kept, wide, cv::NORM_INF), 0) << name;
  }
  for (const char* name : {"still.tif", "still.jpg"}) {
    cv::imwrite((folder_ / name).string(), picture(7));
    EXPECT_FALSE(run({folder_ / name}).contains("warnings")) << name;
    EXPECT_EQ(number_of(frame(0)), 7) << name;
  }
}

}  // namespace
}  // namespace vantage
