#include "jobs/encode/frame_pictures.h"

#include "jobs/vision/colour_space.h"
#include "jobs/vision/maps.h"
#include "jobs/vision/shot_images.h"

namespace vantage {
namespace {

cv::Mat eye_picture(const std::filesystem::path& exr, const std::string& view, const PictureOptions& options) {
  const Channels channels = read_exr(exr, view);
  std::vector<cv::Mat> bgr;
  for (const char* name : {"B", "G", "R"}) bgr.push_back(to_mat(channels.at(name)));
  cv::Mat3f linear;
  cv::merge(bgr, linear);
  if (options.see_through) {
    const cv::Mat1f alpha = to_mat(channels.at("A"));
    for (int y = 0; y < linear.rows; ++y)
      for (int x = 0; x < linear.cols; ++x) linear(y, x) += (1 - alpha(y, x)) * options.background;
  }
  if (options.deep) return srgb16_from_linear(linear);
  return srgb8_from_linear(linear);
}

}  // namespace

std::vector<cv::Mat> frame_pictures(const std::filesystem::path& folder, bool stereo, const PictureOptions& options) {
  if (options.deep || options.see_through) {
    if (!stereo) return {eye_picture(folder / "frame.exr", "", options)};
    return {eye_picture(folder / "frame.exr", "left", options), eye_picture(folder / "frame.exr", "right", options)};
  }
  const cv::Mat png = read_picture(folder / "frame.png");
  if (!stereo) return {png};
  return {png.colRange(0, png.cols / 2), png.colRange(png.cols / 2, png.cols)};
}

}  // namespace vantage
