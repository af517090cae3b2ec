#pragma once
#include <opencv2/core.hpp>

namespace vantage {

/// Fills values where weight is 0 from their surroundings, smoothly and however large the hole: averages over ever
/// coarser levels, then the coarser level wherever a finer one knows nothing. Known values stay. With no known value at
/// all, everything stays as it is.
template <int kChannels>
void push_pull(cv::Mat_<cv::Vec<float, kChannels>>& values, const cv::Mat1f& weight);

extern template void push_pull<1>(cv::Mat_<cv::Vec<float, 1>>&, const cv::Mat1f&);
extern template void push_pull<3>(cv::Mat_<cv::Vec<float, 3>>&, const cv::Mat1f&);

}  // namespace vantage
