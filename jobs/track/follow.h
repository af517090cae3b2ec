#pragma once
#include <functional>
#include <vector>

#include "jobs/track/moving_regions.h"
#include "schema/formats/tracks.h"

namespace vantage::track {

struct FollowOptions {
  int window_px = 15;
  double max_forward_backward_px = 0.5;
  int max_background = 300;
  int max_moving = 700;
  int min_frames = 6;
  double min_motion_px = 3;
  bool camera_moves = false;
};

/// Which pixels of a frame count (not 0), undistorted; empty: all.
using FrameMasks = std::function<cv::Mat1b(int frame)>;

/// Shi-Tomasi corners followed by pyramidal Lucas-Kanade from frame to frame, each step checked by following it back.
/// New corners are sought in every frame where none is near: sparsely everywhere, densely where something moves.
/// Tracks are in order of first frame, then of detection; their looks are empty. `moving` and motion_px say how far the
/// point went: static camera, the extent of its path; moving camera, the extent of what is left of the path after the
/// background's homography from frame to frame (which parallax can add to).
/// counts: no corner is sought where it is 0, and a track that comes there ends.
std::vector<Track> follow_features(int num_frames, const GreyFrames& grey, const FollowOptions& options,
                                   const std::function<void(double fraction)>& on_progress = {},
                                   const FrameMasks& counts = {});

}  // namespace vantage::track
