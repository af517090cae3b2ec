#pragma once
#include <opencv2/core.hpp>
#include <vector>

#include "jobs/render/splat.h"

namespace vantage {

/// A drawn view.
struct ViewPicture {
  cv::Mat3f bgr;    ///< linear light, 0–1
  cv::Mat1f alpha;  ///< 1, or 0 where nothing is known
  cv::Mat1f z;      ///< depth, 0 where unknown
};

/// A layer with its colours, and how much it counts.
struct ColouredLayer {
  Layer layer;
  cv::Mat3f bgr;  ///< linear light, 0–1
  double share = 0;
};

/// Colours of a layer: the image at source_px, Catmull-Rom (the only resampling).
cv::Mat3f layer_colours(const cv::Mat3f& bgr, const Layer& layer);

/// Per pixel: the nearest surface that enough of the layers' weight agrees on (within 5 % of depth, share ×
/// confidence), and the weighted mean of its layers' colours. Pixels of no layer: filled from around; alpha 0 beyond 8
/// px from any layer.
ViewPicture blend(const std::vector<ColouredLayer>& layers);

}  // namespace vantage
