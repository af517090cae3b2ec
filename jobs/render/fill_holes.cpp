#include "jobs/render/fill_holes.h"

#include <algorithm>

#include "jobs/render/push_pull.h"

namespace vantage {

void fill_holes(ViewPicture& picture) {
  const int known = cv::countNonZero(picture.alpha);
  if (known == 0 || known == static_cast<int>(picture.alpha.total())) return;
  double farthest = 0;
  cv::minMaxLoc(picture.z, nullptr, &farthest);
  cv::Mat1f weight(picture.alpha.size(), 0.0F);
  for (int y = 0; y < weight.rows; ++y)
    for (int x = 0; x < weight.cols; ++x) {
      const float far = picture.z(y, x) / static_cast<float>(farthest);
      if (picture.alpha(y, x) > 0) weight(y, x) = std::max(1e-6F, far * far * far * far);
    }
  push_pull<3>(picture.bgr, weight);
}

}  // namespace vantage
