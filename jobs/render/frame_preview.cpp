#include "jobs/render/frame_preview.h"

#include <opencv2/imgproc.hpp>

#include "jobs/render/camera_paint.h"
#include "jobs/vision/colour_space.h"

namespace vantage {
namespace {

constexpr int kPaneWidth = 600;

cv::Mat3b pane(const cv::Mat& picture, const std::string& title) {
  cv::Mat3b small;
  cv::resize(picture, small, {kPaneWidth, kPaneWidth * picture.rows / picture.cols}, 0, 0, cv::INTER_AREA);
  cv::rectangle(small, {0, 0, 12 + 9 * static_cast<int>(title.size()), 20}, cv::Scalar::all(0), cv::FILLED);
  cv::putText(small, title, {6, 15}, cv::FONT_HERSHEY_SIMPLEX, 0.45, cv::Scalar::all(255), 1, cv::LINE_AA);
  return small;
}

/// Names of the cameras that weigh anything, each in its colour.
void write_names(cv::Mat3b& picture, std::span<const SourceImage> images) {
  int y = 38;
  std::string last;
  for (const std::string& name : cameras_of(images))
    for (std::size_t k = 0; k < images.size(); ++k) {
      if (images[k].id.camera != name || name == last) continue;
      last = name;
      cv::putText(picture, name, {6, y}, cv::FONT_HERSHEY_SIMPLEX, 0.45, cv::Scalar::all(0), 3, cv::LINE_AA);
      cv::putText(picture, name, {6, y}, cv::FONT_HERSHEY_SIMPLEX, 0.45, cv::Scalar(camera_paint(images, k)), 1,
                  cv::LINE_AA);
      y += 17;
    }
}

/// The view in grey, what is filled in red, what is guessed less so.
cv::Mat3b holes(const ViewPicture& picture, const cv::Mat3b& bgr) {
  cv::Mat3b out(bgr.size());
  for (int y = 0; y < out.rows; ++y)
    for (int x = 0; x < out.cols; ++x) {
      const float grey = static_cast<float>(bgr(y, x)[0] + bgr(y, x)[1] + bgr(y, x)[2]) / 6;
      const float hole = picture.hole(y, x) * (picture.alpha(y, x) > 0 ? 0.5F : 1.0F);
      out(y, x) = {cv::saturate_cast<uchar>(grey * (1 - hole)), cv::saturate_cast<uchar>(grey * (1 - hole)),
                   cv::saturate_cast<uchar>(grey * (1 - hole) + 255 * hole)};
    }
  return out;
}

}  // namespace

cv::Mat3b frame_preview(const ViewPicture& picture, std::span<const SourceImage> images) {
  const cv::Mat3b bgr = srgb8_from_linear(picture.bgr);
  cv::Mat3b cameras = pane(picture.paint, "cameras");
  write_names(cameras, images);
  cv::Mat above, below, all;
  cv::hconcat(pane(bgr, "view"), cameras, above);
  cv::hconcat(pane(holes(picture, bgr), "filled or guessed"), pane(depth_picture({picture.z, picture.alpha}), "depth"),
              below);
  cv::vconcat(above, below, all);
  return all;
}

}  // namespace vantage
