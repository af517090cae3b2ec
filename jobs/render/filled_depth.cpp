#include "jobs/render/filled_depth.h"

#include <algorithm>

#include "jobs/render/push_pull.h"

namespace vantage {

cv::Mat1f filled_depth(const cv::Mat1f& z, double fallback) {
  double nearest = 0, farthest = 0;
  cv::minMaxLoc(z, &nearest, &farthest);
  if (nearest > 0) return z;
  if (farthest <= 0) return cv::Mat1f(z.size(), static_cast<float>(fallback));
  cv::Mat_<cv::Vec<float, 1>> inverse(z.size(), cv::Vec<float, 1>(0.0F));
  cv::Mat1f weight(z.size(), 0.0F);
  for (int y = 0; y < z.rows; ++y)
    for (int x = 0; x < z.cols; ++x)
      if (z(y, x) > 0) {
        const float far = z(y, x) / static_cast<float>(farthest);
        inverse(y, x)[0] = 1 / z(y, x);
        weight(y, x) = std::max(1e-6F, far * far * far * far);
      }
  push_pull<1>(inverse, weight);
  cv::Mat1f filled(z.size());
  for (int y = 0; y < z.rows; ++y)
    for (int x = 0; x < z.cols; ++x) filled(y, x) = z(y, x) > 0 ? z(y, x) : 1 / inverse(y, x)[0];
  return filled;
}

}  // namespace vantage
