#pragma once
#include <span>

#include "jobs/render/blend.h"
#include "jobs/render/source_image.h"

namespace vantage {

/// A picture for people, 1200 px wide: the view | which camera contributes, by colour | what was filled in (red) or
/// guessed | depth.
cv::Mat3b frame_preview(const ViewPicture& picture, std::span<const SourceImage> images);

}  // namespace vantage
