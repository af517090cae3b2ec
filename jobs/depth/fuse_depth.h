#pragma once
#include <opencv2/core.hpp>
#include <span>

#include "jobs/depth/triangulate_edge.h"
#include "jobs/vision/maps.h"

namespace vantage {

struct FuseDepthOptions {
  double agreement = 0.015;  ///< inverse depths that differ by less than this share agree
  int max_gap_px = 80;       ///< area of unknown spots that are filled
};

/// One depth per pixel: the weighted median of the edges' inverse depths, then the weighted mean of those that agree
/// with it. Confidence: 1 where most of the weight of two or more edges agrees, at most kLoneConfidence where a single
/// edge tells.
constexpr float kLoneConfidence = 0.4F;
DepthMap fuse_depths(std::span<const EdgeDepth> edges, const FuseDepthOptions& options);

/// Removes specks that nothing around agrees with, smooths along surfaces (not across edges of guide), and fills small
/// unknown spots. guide: 8-bit BGR or grey.
DepthMap regularise(const DepthMap& depth, const cv::Mat& guide, const FuseDepthOptions& options);

}  // namespace vantage
