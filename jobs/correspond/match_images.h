#pragma once
/// Dense correspondences of two pictures both ways (Klose et al. 2011, §5.1): what each pixel of one is in the other,
/// how sure that is, and where a surface is hidden.
#include <opencv2/core.hpp>

#include "jobs/correspond/stereo_flow.h"
#include "jobs/vision/maps.h"

namespace vantage {

struct MatchOptions {
  float consistent_px = 1.5F;  ///< a match whose way there and back is longer is taken for occluded
  StereoOptions stereo;
};

struct ImageMatch {
  FlowMap forward, backward;  ///< a to b, b to a
  enum class Model { FixedCamera, StaticScene, None } model = Model::None;
};

/// What a model predicts, where the picture bears it out, and else what an unconstrained search finds. Same pose:
/// nothing moves by itself. Other pose: the scene stood still, so matches lie on epipolar lines. Occluded pixels keep
/// the model's motion: that of the background. b's grey levels are brought to a's first.
ImageMatch match_images(const PosedPicture& a, const PosedPicture& b, const MatchOptions& options);

/// Median distance of confident matches from their epipolar lines; 0 when the views have no parallax. Moving things
/// count, too.
double median_epipolar_residual_px(const ImageMatch& match, const PosedPicture& a, const PosedPicture& b);

/// Share of pixels with confidence, 0–100.
double confident_percent(const FlowMap& flow);

}  // namespace vantage
