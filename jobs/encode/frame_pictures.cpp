#include "jobs/encode/frame_pictures.h"

#include <fmt/format.h>

#include <array>
#include <cctype>

#include "jobs/vision/colour_space.h"
#include "jobs/vision/maps.h"
#include "jobs/vision/shot_images.h"
#include "schema/base/error.h"

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

cv::Vec3f colour_from_hex(const std::string& hex, const std::string& what) {
  const bool digits = hex.size() == 7 && hex[0] == '#' &&
                      std::all_of(hex.begin() + 1, hex.end(), [](unsigned char c) { return std::isxdigit(c) != 0; });
  if (!digits)
    throw Error(ErrorKind::BadInput, fmt::format("{}: is \"{}\", expected a colour like \"#20a040\"", what, hex));
  cv::Vec3f bgr;
  for (int c = 0; c < 3; ++c)
    bgr[2 - c] = linear_from_srgb(
        static_cast<float>(std::stoi(hex.substr(static_cast<std::size_t>(1 + 2 * c), 2), nullptr, 16)) / 255.0F);
  return bgr;
}

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
