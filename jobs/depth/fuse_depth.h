#pragma once
#include <opencv2/core.hpp>
#include <span>

#include "jobs/depth/triangulate_edge.h"
#include "jobs/vision/maps.h"

namespace vantage {

/// One depth per pixel: the weighted median of the edges' inverse depths, then the weighted mean of those that agree
/// with it. agreement: inverse depths that differ by less than this share agree. Confidence: 1 where all the weight of
/// two or more edges agrees, at most kLoneConfidence where a single edge tells.
constexpr float kLoneConfidence = 0.4F;
DepthMap fuse_depths(std::span<const EdgeDepth> edges, double agreement);

}  // namespace vantage
