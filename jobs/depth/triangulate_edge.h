#pragma once
/// Depth that one edge tells: rays of an image meet rays of another, exposed at another moment, after what moves has
/// been carried to the image's moment (Klose et al. 2011, §5.2: motion between neighbouring frames is taken as linear).
#include <opencv2/core.hpp>
#include <optional>

#include "jobs/vision/epipolar.h"
#include "jobs/vision/maps.h"

namespace vantage {

/// How things move in the other image: `flow` to another frame of the same camera, duration_s later (or, if negative,
/// earlier).
struct StepFlow {
  FlowMap flow;
  double duration_s = 0;
};

struct TriangulateOptions {
  double max_epipolar_px = 1.5;
  double min_angle_deg = 1;
};

/// Per pixel: inverse depth (1 / world units), and its weight in a least-squares mean: one over its variance, times
/// the confidence of the matches it comes from. Both 0 where the edge tells nothing.
struct EdgeDepth {
  cv::Mat1f inverse_depth;
  cv::Mat1f weight;
};

/// to_other: image to the other one. lag_s: the image's time minus the other's.
EdgeDepth triangulate_edge(const TwoView& views, double other_focal_px, const FlowMap& to_other, double lag_s,
                           const std::optional<StepFlow>& step, const TriangulateOptions& options);

}  // namespace vantage
