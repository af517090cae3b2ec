#include "jobs/encode/film.h"

#include <fmt/format.h>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/program.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

std::string last_words(const fs::path& log) {
  std::string text = fs::exists(log) ? read_file(log) : std::string();
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const auto line = text.rfind('\n');
  return line == std::string::npos ? text : text.substr(line + 1);
}

}  // namespace

void write_film(const fs::path& mp4, const std::vector<fs::path>& pictures, const FilmOptions& options,
                const fs::path& scratch) {
  if (pictures.empty())
    throw Error(ErrorKind::BadInput, fmt::format("{}: there are no frames to encode", mp4.filename().string()));
  const fs::path folder = scratch / (mp4.stem().string() + "_frames");
  fs::create_directories(folder);
  for (std::size_t k = 0; k < pictures.size(); ++k)
    fs::create_symlink(fs::absolute(pictures[k]), folder / fmt::format("{:06d}.png", k));
  const fs::path log = folder / "ffmpeg.log";
  std::vector<std::string> command{
      "ffmpeg", "-nostdin", "-hide_banner", "-loglevel", "warning", "-y", "-threads", "1", "-framerate",
      fmt::format("{}", options.fps), "-i", (folder / "%06d.png").string(),
      // alpha is for compositing, a film shows the colours; even sizes for yuv420p
      "-vf", "format=rgb24,pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,format=yuv420p",
      "-c:v", "libx264", "-preset", options.preset, "-crf", std::to_string(options.crf), "-threads", "1", "-colorspace",
      "bt709", "-color_primaries", "bt709", "-color_trc", "iec61966-2-1", "-color_range", "tv", "-movflags",
      "+faststart", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"};
  if (options.side_by_side)
    command.insert(command.end(), {"-x264-params", "frame-packing=3", "-metadata:s:v:0", "stereo_mode=left_right"});
  command.push_back(fs::absolute(mp4).string());
  const int rc = run_program(command, {.stdout_file = {}, .stderr_file = log});
  if (rc != 0)
    throw Error(ErrorKind::Resource,
                fmt::format("ffmpeg ended with {} on {}: {}", rc, mp4.filename().string(), last_words(log)));
}

}  // namespace vantage
