#pragma once
#include <deque>
#include <opencv2/core.hpp>

#include "schema/formats/moving_areas.h"

namespace vantage::track {

/// Where things are in motion at the moment of each frame, as a static camera sees it: cells that differ from the
/// picture before as well as from the picture after, so that neither the place that a thing has left nor the one that
/// it goes to counts. No plate is needed, so a thing that hardly leaves its place (and would be part of the plate)
/// shows where it moves.
class MotionRecorder {
 public:
  /// Pictures are compared over about a thirtieth of a second: less shows more noise than motion.
  MotionRecorder(std::string camera, double fps);

  /// The number of the frame that it waits for; others are not taken.
  int next_frame() const { return num_seen_; }
  /// bgr: undistorted; all of one size. counts: 0 where nothing is looked at, same size; empty: everywhere.
  void add(const cv::Mat& bgr, const cv::Mat1b& counts = {});
  /// All frames seen; those at both ends have no runs.
  MovingAreas finish();

 private:
  cv::Mat on_grid(const cv::Mat& bgr);
  std::vector<MovingRun> runs_in_the_middle() const;

  MovingAreas areas_;
  std::size_t reach_ = 1;         ///< frames between the pictures compared
  std::deque<cv::Mat> pictures_;  ///< the last 2 reach_ + 1, on the grid
  std::deque<cv::Mat1b> counts_;  ///< theirs
  int num_seen_ = 0;
};

}  // namespace vantage::track
