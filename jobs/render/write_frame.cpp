#include "jobs/render/write_frame.h"

#include <cmath>

#include "jobs/vision/maps.h"

namespace vantage {

float linear_from_srgb(float value) {
  return value <= 0.04045F ? value / 12.92F : std::pow((value + 0.055F) / 1.055F, 2.4F);
}
float srgb_from_linear(float value) {
  return value <= 0.0031308F ? 12.92F * value : 1.055F * std::pow(value, 1 / 2.4F) - 0.055F;
}

void write_frame_exr(const std::filesystem::path& path, const std::vector<NamedPicture>& views) {
  std::vector<ExrPart> parts;
  for (const NamedPicture& v : views) {
    std::vector<cv::Mat1f> channels;
    cv::split(v.picture.bgr, channels);
    for (cv::Mat1f& channel : channels)
      for (float& value : channel) value = linear_from_srgb(value);
    parts.push_back({.view = v.view,
                     .channels = {{"B", to_plane(channels[0])},
                                  {"G", to_plane(channels[1])},
                                  {"R", to_plane(channels[2])},
                                  {"A", to_plane(v.picture.alpha)},
                                  {"Z", to_plane(v.picture.z)}},
                     .half_channels = {"R", "G", "B", "A"}});
  }
  write_exr(path, parts);
}

cv::Mat frame_png(const std::vector<NamedPicture>& views) {
  std::vector<cv::Mat> pictures;
  for (const NamedPicture& v : views) {
    cv::Mat4b picture(v.picture.bgr.size());
    for (int y = 0; y < picture.rows; ++y)
      for (int x = 0; x < picture.cols; ++x) {
        const cv::Vec3f& c = v.picture.bgr(y, x);
        picture(y, x) = {cv::saturate_cast<uchar>(c[0] * 255), cv::saturate_cast<uchar>(c[1] * 255),
                         cv::saturate_cast<uchar>(c[2] * 255), cv::saturate_cast<uchar>(v.picture.alpha(y, x) * 255)};
      }
    pictures.push_back(picture);
  }
  cv::Mat all;
  cv::hconcat(pictures, all);
  return all;
}

}  // namespace vantage
