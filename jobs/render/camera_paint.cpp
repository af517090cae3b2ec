#include "jobs/render/camera_paint.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <set>

namespace vantage {

std::vector<std::string> cameras_of(std::span<const SourceImage> images) {
  std::set<std::string> names;
  for (const SourceImage& image : images) names.insert(image.id.camera);
  return {names.begin(), names.end()};
}

cv::Vec3f camera_paint(std::span<const SourceImage> images, std::size_t image) {
  const std::vector<std::string> names = cameras_of(images);
  const auto place = std::find(names.begin(), names.end(), images[image].id.camera) - names.begin();
  const auto hue = static_cast<float>(360.0 * static_cast<double>(place) / static_cast<double>(names.size()));
  cv::Mat3f paint(1, 1, cv::Vec3f(hue, 0.8F, 1));
  cv::cvtColor(paint, paint, cv::COLOR_HSV2BGR);
  return 255 * paint(0, 0);
}

}  // namespace vantage
