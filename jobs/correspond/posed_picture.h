#pragma once
#include <opencv2/core.hpp>

#include "jobs/vision/epipolar.h"

namespace vantage {

/// One picture of a pair with its camera. grey: 8 bit.
struct PosedPicture {
  cv::Mat1b grey;
  Pinhole pinhole;
  RigidTransform cam_from_world;
};

/// How points of a are seen in b.
inline TwoView two_views(const PosedPicture& a, const PosedPicture& b) {
  return {a.pinhole, a.cam_from_world, b.pinhole, b.cam_from_world};
}

}  // namespace vantage
