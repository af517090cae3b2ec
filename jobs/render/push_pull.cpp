#include "jobs/render/push_pull.h"

#include <algorithm>

namespace vantage {
namespace {

template <int kChannels>
using Values = cv::Mat_<cv::Vec<float, kChannels>>;

/// Weighted mean of 2 × 2 samples.
template <int kChannels>
void halve(const Values<kChannels>& values, const cv::Mat1f& weight, Values<kChannels>& coarse,
           cv::Mat1f& coarse_weight) {
  coarse.create((values.rows + 1) / 2, (values.cols + 1) / 2);
  coarse_weight.create(coarse.size());
  for (int y = 0; y < coarse.rows; ++y)
    for (int x = 0; x < coarse.cols; ++x) {
      cv::Vec<float, kChannels> sum;
      float total = 0;
      for (int v = 2 * y; v < std::min(2 * y + 2, values.rows); ++v)
        for (int u = 2 * x; u < std::min(2 * x + 2, values.cols); ++u) {
          sum += weight(v, u) * values(v, u);
          total += weight(v, u);
        }
      coarse(y, x) = total > 0 ? sum * (1 / total) : sum;
      coarse_weight(y, x) = std::min(1.0F, total);
    }
}

template <int kChannels>
cv::Vec<float, kChannels> bilinear(const Values<kChannels>& values, float x, float y) {
  const float cx = std::clamp(x, 0.0F, static_cast<float>(values.cols - 1)),
              cy = std::clamp(y, 0.0F, static_cast<float>(values.rows - 1));
  const int x0 = static_cast<int>(cx), y0 = static_cast<int>(cy);
  const int x1 = std::min(x0 + 1, values.cols - 1), y1 = std::min(y0 + 1, values.rows - 1);
  const float a = cx - static_cast<float>(x0), b = cy - static_cast<float>(y0);
  return (1 - b) * ((1 - a) * values(y0, x0) + a * values(y0, x1)) +
         b * ((1 - a) * values(y1, x0) + a * values(y1, x1));
}

}  // namespace

template <int kChannels>
void push_pull(Values<kChannels>& values, const cv::Mat1f& weight) {
  if (values.rows <= 1 && values.cols <= 1) return;
  Values<kChannels> coarse;
  cv::Mat1f coarse_weight;
  halve<kChannels>(values, weight, coarse, coarse_weight);
  push_pull<kChannels>(coarse, coarse_weight);
  for (int y = 0; y < values.rows; ++y)
    for (int x = 0; x < values.cols; ++x)
      if (weight(y, x) <= 0)
        values(y, x) =
            bilinear<kChannels>(coarse, 0.5F * static_cast<float>(x) - 0.25F, 0.5F * static_cast<float>(y) - 0.25F);
}

template void push_pull<1>(Values<1>&, const cv::Mat1f&);
template void push_pull<3>(Values<3>&, const cv::Mat1f&);

}  // namespace vantage
