#pragma once
/// What a picture and a pixel's neighbours tell of its depth. Maps hold inverse depth (1 / world units), 0 where
/// unknown, in which planes are linear.
#include <opencv2/core.hpp>

#include "jobs/vision/maps.h"

namespace vantage {

struct RegulariseOptions {
  double agreement = 0.015;      ///< inverse depths that differ by less than this share are of one surface
  double max_gap_percent = 0.3;  ///< of the picture: unknown spots up to this area are filled
};

/// Removes specks that nothing around agrees with, takes noise out of surfaces (never across steps of depth), moves
/// steps of depth to the outlines in the picture, and fills unknown spots from their farther side: what two cameras
/// do not see together is hidden behind something. guide: 8-bit BGR.
DepthMap regularise(const DepthMap& depth, const cv::Mat3b& guide, const RegulariseOptions& options);

/// Cross-bilateral mean over 5×5 px of those that agree (Tomasi & Manduchi 1998; range in inverse depth and colour).
cv::Mat1f smooth_surfaces(const cv::Mat1f& inverse_depth, const cv::Mat1f& confidence, const cv::Mat3b& guide,
                          double agreement);

}  // namespace vantage
