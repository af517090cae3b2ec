#pragma once
#include <opencv2/core.hpp>
#include <span>
#include <string>
#include <vector>

#include "jobs/render/source_image.h"

namespace vantage {

/// A colour (BGR, 0–255) for each camera of a view, spread over the hues in the order of their names.
cv::Vec3f camera_paint(std::span<const SourceImage> images, std::size_t image);

/// Cameras of the images, each once, in the order of their names.
std::vector<std::string> cameras_of(std::span<const SourceImage> images);

}  // namespace vantage
