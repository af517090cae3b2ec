#pragma once
#include <opencv2/core.hpp>
#include <vector>

#include "jobs/render/splat.h"

namespace vantage {

constexpr uchar kNoLayer = 255;

/// A drawn view.
struct ViewPicture {
  cv::Mat3f bgr;          ///< linear light, 0–1
  cv::Mat1f alpha;        ///< 0 where nothing is known, else 1, or the mattes' alpha, by which bgr is premultiplied
  cv::Mat1f z;            ///< depth, 0 where unknown
  cv::Mat1f hole;         ///< 0–1: how much of the colour is filled in or stands at a guessed place
  cv::Mat3b paint;        ///< the layers' paints mixed as their colours are: who contributes where
  cv::Mat1b strongest{};  ///< which layer weighs most; kNoLayer: none
  cv::Mat2f forward{};  ///< px to the next frame of the film, x right, y down (forward_motion.h); empty: not asked for,
                        ///< or composited
};

/// A layer, the picture it shows, and how much it counts.
struct PictureLayer {
  Layer layer;
  cv::Mat3f bgr;  ///< the image, linear light, 0–1
  float share = 0;
  cv::Vec3f paint{255, 255, 255};  ///< BGR, 0–255
  cv::Mat1f alpha = {};            ///< the image's matte, its colours are premultiplied; empty: opaque
};

/// Per pixel the mean of the layers' colours there, weighted by share × confidence and
/// - visibility: a layer counts less the more weight lies in front of it (by 3 to 8 % of depth), and a surface of
///   less than 2 to 15 % of all weight is an error of depth;
/// - agreement: where colours differ (by much more than noise: half at 50 levels of 255), what most of the weight
///   agrees on counts more than a ghostly mean.
/// All three are continuous in depths, shares and colours, so that nothing pops. Colours are resampled here, once
/// (resample.h). Pixels of no layer stay black with alpha 0 and hole 1.
ViewPicture blend(const std::vector<PictureLayer>& layers);

}  // namespace vantage
