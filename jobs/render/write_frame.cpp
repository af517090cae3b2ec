#include "jobs/render/write_frame.h"

#include "jobs/vision/colour_space.h"
#include "jobs/vision/maps.h"

namespace vantage {
namespace {

void add_motion(Channels& channels, const cv::Mat2f& motion_px) {
  std::vector<cv::Mat1f> uv(2);
  cv::split(motion_px, uv);
  channels["forward.u"] = to_plane(uv[0]);
  channels["forward.v"] = to_plane(cv::Mat1f(-uv[1]));
}

}  // namespace

void write_frame_exr(const std::filesystem::path& path, const std::vector<NamedPicture>& views) {
  std::vector<ExrPart> parts;
  std::vector<ExrCamera> cameras;
  for (const NamedPicture& v : views) {
    std::vector<cv::Mat1f> channels;
    cv::split(v.picture.bgr, channels);
    parts.push_back({.view = v.view,
                     .channels = {{"B", to_plane(channels[0])},
                                  {"G", to_plane(channels[1])},
                                  {"R", to_plane(channels[2])},
                                  {"A", to_plane(v.picture.alpha)},
                                  {"Z", to_plane(v.picture.z)},
                                  {"mask.hole", to_plane(v.picture.hole)}},
                     .half_channels = {"R", "G", "B", "A", "mask.hole", "forward.u", "forward.v"}});
    if (!v.picture.forward.empty()) add_motion(parts.back().channels, v.picture.forward);
    cameras.push_back(v.camera);
  }
  write_exr(path, parts, cameras);
}

namespace {

/// PNG keeps colours that are not multiplied by alpha.
cv::Mat3f straight(const ViewPicture& picture) {
  cv::Mat3f bgr = picture.bgr.clone();
  for (int y = 0; y < bgr.rows; ++y)
    for (int x = 0; x < bgr.cols; ++x)
      if (const float alpha = picture.alpha(y, x); alpha > 0 && alpha < 1) bgr(y, x) *= 1 / alpha;
  return bgr;
}

}  // namespace

cv::Mat frame_png(const std::vector<NamedPicture>& views) {
  std::vector<cv::Mat> pictures;
  for (const NamedPicture& v : views) {
    cv::Mat1b alpha;
    v.picture.alpha.convertTo(alpha, CV_8U, 255);
    cv::Mat picture;
    cv::merge(std::vector<cv::Mat>{srgb8_from_linear(straight(v.picture)), alpha}, picture);
    pictures.push_back(picture);
  }
  cv::Mat all;
  cv::hconcat(pictures, all);
  return all;
}

}  // namespace vantage
