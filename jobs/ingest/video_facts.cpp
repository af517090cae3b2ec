#include "jobs/ingest/video_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <regex>

#include "schema/base/error.h"
#include "schema/base/json.h"
#include "schema/base/program.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr double kFpsWhenUntold = 30;

[[noreturn]] void fail(const fs::path& video, const std::string& what) {
  throw Error(ErrorKind::BadInput, fmt::format("{}: {}", video.string(), what));
}

/// "30000/1001"; 0 for what is no plausible rate.
double rate_of(const std::string& text) {
  double num = 0, den = 0;
  if (std::sscanf(text.c_str(), "%lf/%lf", &num, &den) != 2 || den <= 0) return 0;
  const double rate = num / den;
  return rate > 0.01 && rate < 10000 ? rate : 0;
}

double number_in(const Json& object, const char* key) {
  const std::string text = object.value(key, "");
  const double number = std::strtod(text.c_str(), nullptr);
  return std::isfinite(number) && number > 0 ? number : 0;
}

std::string told(const Json& stream, const char* key) {
  const std::string text = stream.value(key, "");
  return text == "unknown" || text == "reserved" ? "" : text;
}

/// "yuv422p10le" has 10; formats that do not say have 8.
int bits_of(const std::string& pixel_format) {
  static const std::regex many("(?:p|gray|gbrap?|rgb|bgr|rgba|x2rgb|p0)(9|10|12|14|16|48|64)(?:le|be|msble|msbbe)?$");
  std::smatch found;
  if (!std::regex_search(pixel_format, found, many)) return 8;
  const int number = std::stoi(found[1]);
  return number == 48 || number == 64 ? 16 : number;
}

/// The count of a whole track includes what an edit list hides; the duration does not.
int num_promised(const Json& stream, const Json& format, double fps) {
  const double count = number_in(stream, "nb_frames");
  double duration_s = number_in(stream, "duration");
  if (duration_s == 0) duration_s = number_in(format, "duration");
  const double by_time = std::round(duration_s * fps);
  const double promised = count > 0 && by_time > 0 ? std::min(count, by_time) : std::max(count, by_time);
  return promised < 1e8 ? static_cast<int>(promised) : 0;
}

Json probe(const fs::path& video, const fs::path& scratch) {
  std::error_code none;
  if (!fs::exists(video)) fail(video, "does not exist");
  if (fs::file_size(video, none) == 0) fail(video, "is empty (0 bytes), expected a video");
  const fs::path answer = scratch / "facts.json";
  const int status = run_program({"ffprobe", "-v", "quiet", "-select_streams", "v:0", "-show_streams", "-show_format",
                                  "-of", "json", fs::absolute(video).string()},
                                 {.stdout_file = answer, .stderr_file = {}});
  if (status != 0) fail(video, "is not a video that FFmpeg can read");
  return read_json(answer);
}

}  // namespace

VideoFacts read_video_facts(const fs::path& video, const fs::path& scratch) {
  const Json all = probe(video, scratch);
  const Json streams = all.value("streams", Json::array());
  if (streams.empty()) fail(video, "has no picture track, expected a video");
  const Json &stream = streams[0], format = all.value("format", Json::object());
  VideoFacts facts;
  facts.width = stream.value("width", 0), facts.height = stream.value("height", 0);
  if (facts.width <= 0 || facts.height <= 0) fail(video, "is a video without a readable frame");
  facts.fps = rate_of(stream.value("avg_frame_rate", ""));
  if (facts.fps == 0) facts.fps = rate_of(stream.value("r_frame_rate", ""));
  if (facts.fps == 0) facts.fps = kFpsWhenUntold;
  facts.num_promised = num_promised(stream, format, facts.fps);
  facts.codec = stream.value("codec_name", "");
  facts.bits = bits_of(stream.value("pix_fmt", ""));
  facts.matrix = told(stream, "color_space");
  facts.transfer = told(stream, "color_transfer");
  const std::string aspect = stream.value("sample_aspect_ratio", ""), order = stream.value("field_order", "");
  if (aspect != "1:1" && !aspect.starts_with("0:")) facts.pixel_aspect = aspect;
  facts.is_interlaced = order == "tt" || order == "bb" || order == "tb" || order == "bt";
  return facts;
}

std::string VideoFacts::matrix_used() const {
  if (!matrix.empty()) return matrix;
  return height >= 720 || width > 1024 ? "bt709" : "bt601";
}

std::vector<std::string> VideoFacts::warnings() const {
  std::vector<std::string> out;
  if (is_interlaced)
    out.emplace_back(
        "footage is interlaced: each picture is deinterlaced (bwdif) and counts as taken when its first field was");
  if (!pixel_aspect.empty())
    out.push_back(
        fmt::format("pixels of the footage are not square ({} wide to high): pictures are stretched until "
                    "they are",
                    pixel_aspect));
  if (transfer == "smpte2084" || transfer == "arib-std-b67")
    out.push_back(fmt::format("footage is HDR ({}): its values are kept as they are, without tone mapping",
                              transfer == "smpte2084" ? "PQ" : "HLG"));
  return out;
}

}  // namespace vantage
