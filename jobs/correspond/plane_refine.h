#pragma once
/// Inverse depths to a fraction of a pixel.
#include <opencv2/core.hpp>

#include "jobs/correspond/epipolar_shift.h"
#include "jobs/vision/epipolar.h"

namespace vantage {

struct PlaneRefineOptions {
  int iterations = 4;
  /// How far off the given inverse depths may be, px: the first iterations look at pictures as smooth as that.
  double reach_px = 1;
};

/// Every pixel's own Newton step along its epipolar line towards equal grey values, then a plane through the steps
/// around it (Lucas & Kanade 1981, the affine model as a plane in space: inverse depth is linear over a plane's
/// picture). A step counts by its inverse variance; neighbours of another surface, where `known` is 0, and whose grey
/// values do not agree count little. a, b: 8 bit, of like levels. aside_px: how far beside its line each pixel lies.
/// inverse_depth changes only where known.
void refine_on_planes(const cv::Mat1b& a, const cv::Mat1b& b, const ShiftedView& views, const cv::Mat1f& aside_px,
                      const cv::Mat1b& known, const PlaneRefineOptions& options, cv::Mat1f& inverse_depth);

}  // namespace vantage
