#pragma once
#include <span>

#include "jobs/render/blend.h"
#include "jobs/render/source_image.h"
#include "jobs/views/frame_plan.h"

namespace vantage {

/// Draws one eye of a planned frame (Klose et al. 2011, §5.2). images: in the plan's order.
ViewPicture render_eye(std::span<const SourceImage> images, const FramePlan& plan, const PlannedEye& eye);

}  // namespace vantage
