#include "jobs/encode/film.h"

#include <fmt/format.h>

#include <vector>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/program_sink.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

using Words = std::vector<std::string>;

std::string last_words(const fs::path& log) {
  std::string text = fs::exists(log) ? read_file(log) : std::string();
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const auto line = text.rfind('\n');
  return line == std::string::npos ? text : text.substr(line + 1);
}

Words codec_words(const FilmOptions& o) {
  if (o.codec == "prores") return {"-c:v", "prores_ks", "-profile:v", "hq", "-vendor", "apl0"};
  check(o.codec == "h264" && (o.bits == 8 || o.bits == 10), "a film's codec is known: " + o.codec);
  Words words{"-c:v",    "libx264", "-profile:v", o.bits == 10 ? "high10" : "high",
              "-preset", o.preset,  "-crf",       std::to_string(o.crf)};
  if (o.frame_packing > 0)
    words.insert(words.end(), {"-x264-params", fmt::format("frame-packing={}", o.frame_packing)});
  if (o.frame_packing > 0)
    words.insert(words.end(),
                 {"-metadata:s:v:0", o.frame_packing == 4 ? "stereo_mode=top_bottom" : "stereo_mode=left_right"});
  return words;
}

Words command(const fs::path& file, const cv::Mat& first, const FilmOptions& o) {
  const char* pixels = o.codec == "prores" ? "yuv422p10le" : o.bits == 10 ? "yuv420p10le" : "yuv420p";
  Words words{"ffmpeg", "-hide_banner", "-loglevel", "warning", "-y", "-threads", "1", "-f", "rawvideo", "-pix_fmt",
              first.depth() == CV_16U ? "bgr48le" : "bgr24", "-video_size",
              fmt::format("{}x{}", first.cols, first.rows), "-framerate", fmt::format("{}", o.fps), "-i", "pipe:0",
              // even sizes for subsampled colour
              "-vf",
              fmt::format("pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,format={},"
                          "setparams=color_primaries=bt709:color_trc=iec61966-2-1:colorspace=bt709:range=tv",
                          pixels)};
  const Words codec = codec_words(o);
  words.insert(words.end(), codec.begin(), codec.end());
  words.insert(words.end(), {"-threads", "1", "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc",
                             "iec61966-2-1", "-color_range", "tv", "-movflags", "+faststart+write_colr", "-fflags",
                             "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1", fs::absolute(file).string()});
  return words;
}

/// False when ffmpeg takes no more.
bool feed(ProgramSink& ffmpeg, const cv::Mat& picture) {
  const std::size_t bytes_per_row = picture.elemSize() * static_cast<std::size_t>(picture.cols);
  for (int y = 0; y < picture.rows; ++y)
    if (!ffmpeg.write(picture.ptr<char>(y), bytes_per_row)) return false;
  return true;
}

}  // namespace

void write_film(const fs::path& file, std::size_t count, const std::function<cv::Mat(std::size_t)>& picture,
                const FilmOptions& options, const fs::path& log) {
  const std::string name = file.filename().string();
  if (count == 0) throw Error(ErrorKind::BadInput, name + ": there are no frames to encode");
  const cv::Mat first = picture(0);
  check(first.type() == CV_8UC3 || first.type() == CV_16UC3, "a film's pictures are BGR of 8 or 16 bits");
  ProgramSink ffmpeg(command(file, first, options), log);
  bool takes_more = feed(ffmpeg, first);
  for (std::size_t k = 1; takes_more && k < count; ++k) {
    const cv::Mat next = picture(k);
    if (next.size() != first.size() || next.type() != first.type())
      throw Error(ErrorKind::BadInput, fmt::format("{}: frame {} is {}x{}, expected {}x{} like the first", name, k,
                                                   next.cols, next.rows, first.cols, first.rows));
    takes_more = feed(ffmpeg, next);
  }
  const int rc = ffmpeg.finish();
  if (rc != 0 || !takes_more)
    throw Error(ErrorKind::Resource, fmt::format("ffmpeg ended with {} on {}: {}", rc, name, last_words(log)));
}

}  // namespace vantage
