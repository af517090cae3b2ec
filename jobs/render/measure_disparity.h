#pragma once
#include "jobs/render/blend.h"
#include "jobs/views/frame_disparity.h"
#include "jobs/views/stereo_plan.h"

namespace vantage {

/// Disparities of a drawn pair. curve: what the drawing mapped them with.
FrameDisparity measure_disparity(const ViewPicture& left, const ViewPicture& right, const StereoPlan& plan,
                                 const DisparityCurve& curve);

/// Black bars of the plan's floating window, known to be black, on the left eye's left and the right eye's right: both
/// eyes then see the picture's frame in front of the screen.
void draw_floating_window(ViewPicture& left, ViewPicture& right, const StereoPlan& plan);

}  // namespace vantage
