#include "jobs/track/motion_recorder.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "jobs/track/moving_regions.h"
#include "schema/base/error.h"

namespace vantage::track {
namespace {

/// Fine enough to tell time by, coarse enough to be quick and free of noise.
constexpr int kMaxCells = 640;
constexpr double kReachS = 1.0 / 30;
/// Smaller areas are noise.
constexpr int kMinAreaCells = 12;

/// The largest difference of the three colours.
cv::Mat difference(const cv::Mat& p, const cv::Mat& q) {
  cv::Mat all;
  cv::absdiff(p, q, all);
  cv::Mat channels[3], most;
  cv::split(all, channels);
  cv::max(channels[0], channels[1], most);
  cv::max(most, channels[2], most);
  return most;
}

void drop_small_areas(cv::Mat& mask) {
  cv::Mat1i labels, stats;
  cv::Mat1d centres;
  const int num = cv::connectedComponentsWithStats(mask, labels, stats, centres, 8);
  if (num < 2) return;
  mask.forEach<uchar>([&](uchar& value, const int* at) {
    if (stats(labels(at[0], at[1]), cv::CC_STAT_AREA) < kMinAreaCells) value = 0;
  });
}

std::vector<MovingRun> runs_of(const cv::Mat1b& mask) {
  std::vector<MovingRun> runs;
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x) {
      if (mask(y, x) == 0) continue;
      const int begin = x;
      while (x < mask.cols && mask(y, x) != 0) ++x;
      runs.push_back({static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(x)});
    }
  return runs;
}

}  // namespace

MotionRecorder::MotionRecorder(std::string camera, double fps) {
  areas_.camera = std::move(camera);
  reach_ = static_cast<std::size_t>(std::max(1L, std::lround(kReachS * fps)));
}

cv::Mat MotionRecorder::on_grid(const cv::Mat& bgr) {
  const int cell_px = std::max(1, (std::max(bgr.cols, bgr.rows) + kMaxCells - 1) / kMaxCells);
  const cv::Size grid(bgr.cols / cell_px, bgr.rows / cell_px);
  if (num_seen_ == 0) areas_.cell_px = cell_px, areas_.columns = grid.width, areas_.rows = grid.height;
  check(grid == cv::Size(areas_.columns, areas_.rows), "all pictures of a camera are of one size");
  cv::Mat small;
  cv::resize(bgr({0, 0, grid.width * cell_px, grid.height * cell_px}), small, grid, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(small, small, {0, 0}, 1);
  return small;
}

void MotionRecorder::add(const cv::Mat& bgr, const cv::Mat1b& counts) {
  pictures_.push_back(on_grid(bgr));
  counts_.emplace_back();
  if (!counts.empty()) cv::resize(counts, counts_.back(), pictures_.back().size(), 0, 0, cv::INTER_NEAREST);
  if (pictures_.size() > 2 * reach_ + 1) pictures_.pop_front(), counts_.pop_front();
  areas_.frames.emplace_back();
  ++num_seen_;
  if (pictures_.size() == 2 * reach_ + 1) areas_.frames[areas_.frames.size() - 1 - reach_] = runs_in_the_middle();
}

std::vector<MovingRun> MotionRecorder::runs_in_the_middle() const {
  const cv::Mat before = difference(pictures_[reach_], pictures_.front()),
                after = difference(pictures_[reach_], pictures_.back());
  cv::Mat mask;
  cv::min(before, after, mask);
  cv::threshold(mask, mask, std::max(noise_threshold(before), noise_threshold(after)), 255, cv::THRESH_BINARY);
  if (!counts_[reach_].empty()) mask.setTo(0, counts_[reach_] == 0);
  cv::morphologyEx(mask, mask, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}));
  drop_small_areas(mask);
  return runs_of(mask);
}

MovingAreas MotionRecorder::finish() { return std::move(areas_); }

}  // namespace vantage::track
