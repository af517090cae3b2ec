#pragma once
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "jobs/render/blend.h"
#include "jobs/render/pixel_places.h"

namespace vantage {

/// How far what each pixel of a view shows has moved in the next frame of the film: by the next camera and by its own
/// motion until then, px, x right and y down; 0 where unknown. Each pixel as its strongest layer says, which tells it
/// at the nearest pixel of its image. layers, now, next: as the view was drawn, and the view to come.
cv::Mat2f forward_motion(std::span<const SourceImage> images, const std::vector<PictureLayer>& layers,
                         const cv::Mat1b& strongest, const ViewCamera& now, const PlacingOptions& at_now,
                         const ViewCamera& next, const PlacingOptions& at_next);

}  // namespace vantage
