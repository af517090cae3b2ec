#pragma once
/// Dense stereo between two posed views without rectification: hypotheses are planes of equal inverse depth, matched by
/// census and made smooth by semi-global matching (Hirschmüller 2008) along 8 paths. Assumes a static scene; what moved
/// between two exposures is matched wrongly or not at all, and the caller must look elsewhere for it.
#include <opencv2/core.hpp>

#include "jobs/correspond/posed_picture.h"
#include "jobs/vision/epipolar.h"

namespace vantage {

/// Inverse depths first, first + step, …: 1 / world units along the first view's axis.
struct Sweep {
  double first = 0, step = 0;
  int count = 0;
  double last() const { return first + step * (count - 1); }
};

/// Steps of at most one pixel of view b anywhere in a picture of that size. count is limited to max_count by wider
/// steps. count 0 when the views have no parallax.
Sweep sweep_between(const TwoView& views, cv::Size size, double first, double last, int max_count);

/// All that both pictures could show: where lines enter b to where they have crossed as much as a picture's width.
Sweep widest_sweep(const TwoView& views, cv::Size size, int max_count);

/// Inverse depth of every pixel of a, between two hypotheses by a parabola through the costs.
cv::Mat1f sweep_inverse_depth(const PosedPicture& a, const PosedPicture& b, const Sweep& sweep);

}  // namespace vantage
