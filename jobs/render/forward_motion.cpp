#include "jobs/render/forward_motion.h"

#include <algorithm>

namespace vantage {
namespace {

/// Per pixel of the image: its place in the next frame less that in this one; 0 where either is behind the camera.
cv::Mat2f steps(const PixelPlaces& now, const PixelPlaces& next) {
  const cv::Size size = now.size();
  cv::Mat2f out(size);
  PlacedRow here(size.width), there(size.width);
  for (int y = 0; y < size.height; ++y) {
    now.row(y, here);
    next.row(y, there);
    for (int x = 0; x < size.width; ++x) {
      const auto k = static_cast<std::size_t>(x);
      const bool seen = here.z[k] > 0 && there.z[k] > 0;
      out(y, x) = seen ? cv::Vec2f(there.x[k] - here.x[k], there.y[k] - here.y[k]) : cv::Vec2f(0, 0);
    }
  }
  return out;
}

}  // namespace

cv::Mat2f forward_motion(std::span<const SourceImage> images, const std::vector<PictureLayer>& layers,
                         const cv::Mat1b& strongest, const ViewCamera& now, const PlacingOptions& at_now,
                         const ViewCamera& next, const PlacingOptions& at_next) {
  cv::Mat2f motion(strongest.size(), cv::Vec2f(0, 0));
  cv::parallel_for_(cv::Range(0, static_cast<int>(images.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      if (cv::countNonZero(strongest == i) == 0) continue;
      const cv::Mat2f step = steps(PixelPlaces(images, i, now, at_now), PixelPlaces(images, i, next, at_next));
      const cv::Mat2f& source_px = layers[static_cast<std::size_t>(i)].layer.source_px;
      for (int y = 0; y < motion.rows; ++y)
        for (int x = 0; x < motion.cols; ++x) {
          if (strongest(y, x) != i) continue;
          const cv::Vec2f px = source_px(y, x);
          motion(y, x) = step(std::clamp(static_cast<int>(px[1]), 0, step.rows - 1),
                              std::clamp(static_cast<int>(px[0]), 0, step.cols - 1));
        }
    }
  });
  return motion;
}

}  // namespace vantage
