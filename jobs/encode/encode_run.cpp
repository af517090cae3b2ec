#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

#include "jobs/encode/encode_job.h"
#include "jobs/encode/film.h"
#include "jobs/vision/shot_images.h"
#include "schema/base/error.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

std::vector<fs::path> pictures_of(JobContext& context) {
  std::vector<fs::path> pictures;
  for (const Json& job : context.unit().at("frames"))
    pictures.push_back(context.input(job.get<std::string>()) / "frame.png");
  return pictures;
}

/// Anaglyphs of side-by-side pictures, as PNG files in the scratch folder.
std::vector<fs::path> anaglyphs(JobContext& context, const std::vector<fs::path>& side_by_side) {
  fs::create_directories(context.scratch() / "anaglyphs");
  std::vector<fs::path> pictures;
  for (std::size_t k = 0; k < side_by_side.size(); ++k) {
    const cv::Mat3b both = read_picture(side_by_side[k]);
    const int width = both.cols / 2;
    pictures.push_back(context.scratch() / "anaglyphs" / fmt::format("{:06d}.png", k));
    write_picture(pictures.back(), anaglyph(both.colRange(0, width), both.colRange(width, 2 * width)));
    context.progress(0.6 + 0.3 * static_cast<double>(k) / static_cast<double>(side_by_side.size()), "anaglyph");
  }
  return pictures;
}

void write_preview(JobContext& context, const fs::path& picture) {
  const cv::Mat full = read_picture(picture);
  const double scale = std::min(1.0, 480.0 / full.cols);
  cv::Mat small;
  cv::resize(full, small, {}, scale, scale, cv::INTER_AREA);
  write_picture(context.out("preview.jpg"), small);
}

}  // namespace

void EncodeJob::run(JobContext& context, const Params& params) {
  const std::vector<fs::path> pictures = pictures_of(context);
  const std::string film = context.unit().at("name").get<std::string>() + ".mp4";
  const bool stereo = context.unit().at("stereo");
  FilmOptions options{
      .fps = context.unit().at("fps"), .crf = params.crf, .preset = params.preset, .side_by_side = stereo};
  context.progress(0, "encoding");
  write_film(context.out(film), pictures, options, context.scratch());
  if (stereo) {
    const fs::path side_by_side = context.out("side_by_side.mp4");
    if (side_by_side.filename() != film) fs::copy_file(context.out(film), side_by_side);
    options.side_by_side = false;
    write_film(context.out("anaglyph.mp4"), anaglyphs(context, pictures), options, context.scratch());
  }
  write_preview(context, pictures[pictures.size() / 2]);
  context.figure("frames", pictures.size());
  context.figure("seconds", static_cast<double>(pictures.size()) / options.fps);
}

}  // namespace vantage
