#include "jobs/calibrate/plate.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "schema/base/error.h"

namespace vantage {
namespace {

constexpr int kLeastNoiseLevels = 10;  // compression and flicker of clean footage
constexpr double kNoiseSpread = 6;     // medians of the deviation: about 4 standard deviations
constexpr double kMostlySteady = 0.75;

/// Largest difference of the three channels.
cv::Mat1b deviation(const cv::Mat& a, const cv::Mat& b) {
  cv::Mat difference;
  cv::absdiff(a, b, difference);
  std::vector<cv::Mat> channels;
  cv::split(difference, channels);
  cv::max(channels[0], channels[1], channels[0]);
  cv::max(channels[0], channels[2], channels[0]);
  return channels[0];
}

cv::Mat disc(int diameter) { return cv::getStructuringElement(cv::MORPH_ELLIPSE, {diameter, diameter}); }

/// From the median deviation of all pixels: what moves covers less than half of the pictures.
int noise_levels(const std::vector<cv::Mat1b>& deviations) {
  std::array<std::int64_t, 256> histogram{};
  std::int64_t num = 0;
  for (const auto& d : deviations)
    for (const uchar level : d) {
      ++histogram[level];
      ++num;
    }
  int median = 0;
  for (std::int64_t below = histogram[0]; 2 * below < num; below += histogram[static_cast<std::size_t>(median)])
    ++median;
  return std::max(kLeastNoiseLevels, static_cast<int>(std::lround(kNoiseSpread * median)));
}

cv::Mat steady_mask(const std::vector<cv::Mat1b>& deviations, int noise_levels) {
  cv::Mat num_like_median(deviations[0].size(), CV_16U, cv::Scalar(0));
  for (const auto& d : deviations) cv::add(num_like_median, cv::Scalar(1), num_like_median, d <= noise_levels);
  cv::Mat steady = num_like_median >= kMostlySteady * static_cast<double>(deviations.size());
  cv::erode(steady, steady, disc(5));
  return steady;
}

}  // namespace

std::vector<int> spread_frames(int num_frames, int max_frames) {
  const int num = std::min(num_frames, max_frames);
  std::vector<int> frames;
  for (int i = 0; i < num; ++i)
    frames.push_back(num == 1 ? num_frames / 2
                              : static_cast<int>(std::lround(static_cast<double>(i) * (num_frames - 1) / (num - 1))));
  return frames;
}

cv::Mat median_plate(const std::vector<cv::Mat>& pictures) {
  check(!pictures.empty(), "a camera has at least one picture");
  cv::Mat plate(pictures[0].size(), pictures[0].type());
  std::vector<uchar> values(pictures.size());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  const int row_bytes = plate.cols * plate.channels();
  for (int y = 0; y < plate.rows; ++y)
    for (int x = 0; x < row_bytes; ++x) {
      for (std::size_t k = 0; k < pictures.size(); ++k) values[k] = pictures[k].ptr(y)[x];
      std::nth_element(values.begin(), middle, values.end());
      plate.ptr(y)[x] = *middle;
    }
  return plate;
}

Plate make_plate(const std::vector<cv::Mat>& pictures) {
  Plate out{.bgr = median_plate(pictures), .steady = {}};
  std::vector<cv::Mat1b> deviations;
  for (const auto& picture : pictures) deviations.push_back(deviation(picture, out.bgr));
  out.noise_levels = noise_levels(deviations);
  out.steady = steady_mask(deviations, out.noise_levels);
  return out;
}

cv::Mat what_moves(const cv::Mat& bgr, const Plate& plate) {
  cv::Mat mask = deviation(bgr, plate.bgr) > plate.noise_levels;
  cv::morphologyEx(mask, mask, cv::MORPH_OPEN, disc(3));
  cv::dilate(mask, mask, disc(9));
  return mask;
}

}  // namespace vantage
