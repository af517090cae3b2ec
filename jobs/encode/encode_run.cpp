#include <fmt/format.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "jobs/encode/depth_budget.h"
#include "jobs/encode/encode_job.h"
#include "jobs/encode/film.h"
#include "jobs/encode/frame_pictures.h"
#include "jobs/encode/layout.h"
#include "jobs/views/hex_colour.h"
#include "jobs/vision/colour_space.h"
#include "jobs/vision/shot_images.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

cv::Vec3f linear_colour(const std::array<std::uint8_t, 3>& rgb) {
  return linear_from_srgb(cv::Mat(1, 1, CV_8UC3, cv::Scalar(rgb[2], rgb[1], rgb[0])))(0, 0);
}

/// The films of one render.
class Encoder {
 public:
  Encoder(JobContext& context, const EncodeJob::Params& params)
      : context_(context),
        params_(params),
        name_(context.unit().at("name")),
        fps_(context.unit().at("fps")),
        stereo_(context.unit().at("stereo")),
        see_through_(context.unit().at("see_through")),
        background_(linear_colour(rgb_from_hex(params.background, "[encode] background"))) {
    for (const Json& job : context.unit().at("jobs")) folders_.push_back(context.input(job.get<std::string>()));
    num_films_ = 1.0 + (params.prores ? 1 : 0);
    if (stereo_)
      num_films_ += static_cast<double>(std::ranges::count_if(params.stereo, [&](const auto& f) { return is_own(f); }));
  }

  void write_films() {
    const std::string layout = stereo_ ? kFilmLayout : "";
    write(name_ + ".mp4", layout, "h264");
    if (params_.prores) write(name_ + ".mov", layout, "prores");
    if (!stereo_) return;
    for (const std::string& film : params_.stereo)
      if (is_own(film)) write(film + ".mp4", film, "h264");
  }

  void write_preview() const {
    const cv::Mat full = picture(folders_.size() / 2, stereo_ ? kFilmLayout : "", false);
    const double scale = std::min(1.0, 480.0 / full.cols);
    cv::Mat small;
    cv::resize(full, small, {}, scale, scale, cv::INTER_AREA);
    write_picture(context_.out("preview.jpg"), small);
  }

  void write_depth_budget() const {
    const DepthBudget budget{context_.unit().at("crossed_percent"), context_.unit().at("uncrossed_percent")};
    std::vector<BudgetFrame> frames;
    for (std::size_t k = 0; k < folders_.size(); ++k)
      frames.push_back({context_.unit().at("frames").at(k), read_frame_disparity(folders_[k] / "disparity.json")});
    Json table = depth_budget_table(frames, budget);
    write_json(context_.out("depth_budget.json"), table);
    write_picture(context_.out("depth_budget.png"), depth_budget_chart(frames, budget));
    table.erase("frames");
    context_.figure("depth_budget", table);
    for (const std::string& warning : depth_budget_warnings(frames, budget)) context_.warn(warning);
  }

  std::size_t num_frames() const { return folders_.size(); }

 private:
  cv::Mat picture(std::size_t k, const std::string& layout, bool deep) const {
    const std::vector<cv::Mat> eyes =
        frame_pictures(folders_[k], stereo_, {.deep = deep, .see_through = see_through_, .background = background_});
    return stereo_ ? lay_out(eyes.at(0), eyes.at(1), layout) : eyes.at(0);
  }

  /// Not the film itself, by its layout or by its name.
  bool is_own(const std::string& layout) const { return layout != kFilmLayout && layout != name_; }

  void write(const std::string& file, const std::string& layout, const std::string& codec) {
    const bool deep = codec == "prores" || params_.bits > 8;
    const auto next = [&](std::size_t k) {
      const double films = num_done_ + static_cast<double>(k) / static_cast<double>(folders_.size());
      context_.progress(films / num_films_, file);
      return picture(k, layout, deep);
    };
    const FilmOptions options{.fps = fps_,
                              .codec = codec,
                              .bits = params_.bits,
                              .crf = params_.crf,
                              .preset = params_.preset,
                              .frame_packing = frame_packing(layout)};
    write_film(context_.out(file), folders_.size(), next, options, context_.scratch() / (file + ".log"));
    num_done_ += 1;
  }

  JobContext& context_;
  const EncodeJob::Params& params_;
  std::string name_;
  double fps_;
  bool stereo_, see_through_;
  cv::Vec3f background_;           ///< linear light, BGR
  std::vector<fs::path> folders_;  ///< of the render jobs, a frame each
  double num_films_ = 1, num_done_ = 0;
};

}  // namespace

void EncodeJob::run(JobContext& context, const Params& params) {
  Encoder encoder(context, params);
  encoder.write_films();
  encoder.write_preview();
  if (context.unit().at("stereo")) encoder.write_depth_budget();
  context.figure("frames", encoder.num_frames());
  context.figure("seconds", static_cast<double>(encoder.num_frames()) / context.unit().at("fps").get<double>());
}

}  // namespace vantage
