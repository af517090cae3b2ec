#include "jobs/track/moving_regions.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace vantage::track {
namespace {

constexpr int kMaxPlateFrames = 31;

double median_level(const cv::Mat1b& levels) {
  std::vector<std::size_t> counts(256, 0);
  for (const auto level : levels) ++counts[level];
  const std::size_t half = levels.total() / 2;
  std::size_t sum = 0;
  for (std::size_t level = 0; level < counts.size(); ++level)
    if ((sum += counts[level]) > half) return static_cast<double>(level);
  return 255;
}

}  // namespace

cv::Mat1b background_plate(int num_frames, const GreyFrames& grey) {
  const int num = std::min(num_frames, kMaxPlateFrames);
  std::vector<cv::Mat1b> frames;
  for (int k = 0; k < num; ++k)
    frames.push_back(grey(static_cast<int>(static_cast<std::int64_t>(k) * num_frames / num)));
  cv::Mat1b plate(frames.front().size());
  std::vector<uchar> levels(frames.size());
  for (int y = 0; y < plate.rows; ++y)
    for (int x = 0; x < plate.cols; ++x) {
      for (std::size_t k = 0; k < frames.size(); ++k) levels[k] = frames[k](y, x);
      const auto middle = levels.begin() + static_cast<std::ptrdiff_t>(levels.size() / 2);
      std::nth_element(levels.begin(), middle, levels.end());
      plate(y, x) = *middle;
    }
  return plate;
}

double noise_threshold(const cv::Mat1b& difference) {
  // Half a level is the least that 8-bit medians can tell.
  const double noise = 1.4826 * std::max(0.5, median_level(difference));
  return std::max(8.0, 4 * noise);
}

cv::Mat1b changed_pixels(const cv::Mat1b& picture, const cv::Mat1b& reference) {
  cv::Mat1b difference, mask;
  cv::absdiff(picture, reference, difference);
  const double threshold = noise_threshold(difference);
  cv::GaussianBlur(difference, difference, {3, 3}, 0);
  cv::threshold(difference, mask, threshold, 255, cv::THRESH_BINARY);
  cv::morphologyEx(mask, mask, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_RECT, {2, 2}));
  cv::dilate(mask, mask, cv::getStructuringElement(cv::MORPH_RECT, {5, 5}));
  return mask;
}

cv::Mat1b MovingRegions::mask(const cv::Mat1b& grey, const cv::Mat1b& previous, const cv::Mat& previous_to_this) const {
  if (plate_) return changed_pixels(grey, *plate_);
  cv::Mat1b none(grey.size(), uchar{0});
  if (previous.empty() || previous_to_this.empty()) return none;
  cv::Mat1b warped = grey.clone();  // where the previous frame saw nothing, nothing changed
  cv::warpPerspective(previous, warped, previous_to_this, grey.size(), cv::INTER_LINEAR, cv::BORDER_TRANSPARENT);
  return changed_pixels(grey, warped);
}

}  // namespace vantage::track
