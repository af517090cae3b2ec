#pragma once
#include <opencv2/core.hpp>

#include "jobs/render/pixel_places.h"

namespace vantage {

/// One image as the view sees it.
struct Layer {
  cv::Mat2f source_px;  ///< the image's pixel (centres at +0.5) that each pixel of the view shows
  cv::Mat1f z;          ///< depth in the view; 0: the image does not cover this pixel
  cv::Mat1f confidence;
  cv::Mat1f order;  ///< what is in front: less is nearer, by the ratio; depth as far as it counts
};

/// Forward warp without holes (Mark et al. 1997): every 2 × 2 pixels of the image are two triangles, drawn into the
/// view with a depth test. Triangles that turn over or tear (an edge grows by more than 3 px) are gaps between surfaces
/// and left out; the more a triangle is stretched the less it counts. expected_scale: size of a pixel of the image in
/// pixels of the view.
Layer splat(const PixelPlaces& places, cv::Size view_size, double expected_scale);

}  // namespace vantage
