#include "jobs/ingest/video_pictures.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <opencv2/imgproc.hpp>

#include "schema/base/error.h"
#include "schema/base/program_pipe.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr int kNumSignals = 65;  // Linux

/// By way of planar RGB, which swscale converts to at more than twice the speed (measured), to the same values; 16 bits
/// where 8 would round. showinfo last: it tells of exactly the pictures that come out.
std::string filters_of(const VideoFacts& facts) {
  std::string chain = facts.is_interlaced ? "bwdif=mode=send_frame:deint=interlaced," : "";
  chain += fmt::format(
      R"(scale=w='if(gt(sar\,1)\,round(iw*sar)\,iw)':h='if(lt(sar\,1)\,round(ih/sar)\,ih)':in_color_matrix={}:)",
      facts.matrix.empty() ? facts.matrix_used() : "auto");
  chain += "flags=bicubic+accurate_rnd+full_chroma_int,";
  chain += facts.bits > 8 ? "format=gbrp16le,scale,format=rgb48be," : "format=gbrp,scale,format=rgb24,";
  return chain + "showinfo=checksum=0";
}

void swap_bytes(cv::Mat& rgb16) {
  auto* values = rgb16.ptr<std::uint16_t>();
  for (std::size_t k = 0; k < 3 * rgb16.total(); ++k)
    values[k] = static_cast<std::uint16_t>(values[k] << 8 | values[k] >> 8);
}

std::vector<std::string> command(const fs::path& video, const VideoFacts& facts) {
  return {"ffmpeg", "-hide_banner", "-nostats", "-nostdin", "-loglevel", "repeat+info",
          // One core: a farm has as many such jobs as cores.
          "-threads", "1", "-filter_threads", "1", "-copyts", "-i", fs::absolute(video).string(), "-map", "0:v:0",
          "-vf", filters_of(facts), "-vsync", "passthrough", "-f", "image2pipe", "-c:v", "ppm", "pipe:1"};
}

}  // namespace

/// What ffmpeg prints, read as it grows: it tells of a picture before it gives it.
class VideoPictures::Messages {
 public:
  explicit Messages(fs::path file) : file_(std::move(file)) {
    std::ofstream(file_, std::ios::trunc);
    in_.open(file_);
  }
  const fs::path& file() const { return file_; }

  struct Picture {
    std::optional<double> time_s;
    int num_damaged_before = 0;
  };
  /// Reads on to the next picture's line.
  Picture next_picture() {
    Picture picture;
    for (std::string line; next_line(line);) {
      picture.num_damaged_before += line.find("Error while decoding stream") != std::string::npos ||
                                    line.find("corrupt decoded frame") != std::string::npos;
      if (line.find("Parsed_showinfo") == std::string::npos) continue;
      if (const auto at = line.find("config in time_base: "); at != std::string::npos)
        read_time_base(line.substr(at + 21));
      const auto number = line.find("] n:"), pts = line.find(" pts:");
      if (number == std::string::npos || pts == std::string::npos) continue;
      std::int64_t ticks = 0;
      if (std::sscanf(line.c_str() + pts, " pts:%ld", &ticks) == 1)
        picture.time_s = static_cast<double>(ticks) * tick_s_;
      break;
    }
    return picture;
  }

 private:
  void read_time_base(const std::string& text) {
    double num = 0, den = 0;
    if (std::sscanf(text.c_str(), "%lf/%lf", &num, &den) == 2 && den > 0) tick_s_ = num / den;
  }
  /// A whole line; false while there is none.
  bool next_line(std::string& line) {
    in_.clear();
    for (std::string part; std::getline(in_, part);) {
      unfinished_ += part;
      if (in_.eof()) return false;
      line = std::exchange(unfinished_, "");
      return true;
    }
    return false;
  }

  fs::path file_;
  std::ifstream in_;
  std::string unfinished_;
  double tick_s_ = 0;
};

struct VideoPictures::Pipe {
  ProgramPipe program;
  Pipe(const std::vector<std::string>& argv, const fs::path& stderr_file) : program(argv, stderr_file) {}

  /// One number of a PPM header ("P6", width, height, largest value), each on its own or after a blank.
  std::optional<int> header_number() {
    std::string digits;
    for (char c = 0; program.read(&c, 1) == 1 && digits.size() < 16;) {
      if (c != ' ' && c != '\n')
        digits += c;
      else
        return std::atoi(digits.c_str());
    }
    return std::nullopt;
  }
  /// RGB of 8 bits, or 16 (big-endian in the file); empty at the end.
  cv::Mat next() {
    std::array<char, 3> magic{};
    if (program.read(magic.data(), magic.size()) < magic.size()) return {};
    check(magic[0] == 'P' && magic[1] == '6', "ffmpeg writes PPM pictures");
    const auto width = header_number(), height = header_number(), largest = header_number();
    if (!width || !height || !largest) return {};
    cv::Mat rgb(*height, *width, *largest > 255 ? CV_16UC3 : CV_8UC3);
    const std::size_t num_bytes = rgb.total() * rgb.elemSize();
    if (program.read(rgb.ptr<char>(), num_bytes) < num_bytes) return {};
    if (rgb.depth() == CV_16U) swap_bytes(rgb);
    return rgb;
  }
};

VideoPictures::VideoPictures(const fs::path& video, const VideoFacts& facts, const fs::path& scratch)
    : messages_(std::make_unique<Messages>(scratch / "ffmpeg.log")),
      pipe_(std::make_unique<Pipe>(command(video, facts), messages_->file())) {}

VideoPictures::~VideoPictures() = default;

cv::Mat VideoPictures::next() {
  cv::Mat picture = pipe_->next();
  const auto told = messages_->next_picture();
  num_damaged_ += told.num_damaged_before;
  time_s_ = told.time_s;
  if (picture.empty()) {
    // Its own status says nothing: damaged footage ends with an error, too. But killed from outside it would pass for
    // the footage's end.
    if (const int status = pipe_->program.wait(); status > 128 && status < 128 + kNumSignals)
      throw Error(ErrorKind::Resource,
                  fmt::format("ffmpeg was ended by signal {} while decoding; is memory short?", status - 128));
    return {};
  }
  cv::cvtColor(picture, picture, cv::COLOR_RGB2BGR);
  return picture;
}

}  // namespace vantage
