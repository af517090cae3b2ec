#pragma once
/// Textured layers that slide over each other, with their exact motion.
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "tests/support/texture.h"

namespace vantage::synthetic {

/// A disc (or, radius_px 0, everything) with a texture of its own that moves by motion_px, also turning.
struct Layer {
  cv::Point2d centre_px;
  double radius_px = 0;
  cv::Vec2d motion_px;
  double turn_rad = 0;
};

struct LayeredPair {
  cv::Mat1b a, b;
  cv::Mat2f a_to_b;
  cv::Mat1b visible;  ///< pixels of a that b shows, too
  cv::Mat1b layer;    ///< of each pixel of a
};

/// Later layers lie in front. Grey values are exact at pixel centres up to rounding; noise is added to both pictures.
LayeredPair render_layers(cv::Size size, const std::vector<Layer>& layers, double noise_grey = 1);

}  // namespace vantage::synthetic
