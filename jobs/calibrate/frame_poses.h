#pragma once
#include <functional>
#include <map>
#include <opencv2/core.hpp>
#include <vector>

#include "jobs/calibrate/sparse_model.h"

namespace vantage {

struct FramePoses {
  std::map<int, RigidTransform> cam_from_world;
  int num_interpolated = 0;  ///< frames that too few points could be followed to: between or beside their neighbours
};

/// Poses of all frames of a moving camera from those of its key frames: the key frames' points are followed by KLT from
/// each key frame to the next one, forwards and backwards, and every frame between is placed by them (PnP: EPnP in
/// RANSAC, then Levenberg-Marquardt on the inliers), and the path then smoothed as far as its own noise asks for it
/// (smooth_path.h). times_s: of all frames. frame_bgr: a frame in the footage's pixels; asked for in rising
/// order. The camera has one key frame with a pose at least.
FramePoses place_frames(const SparseModel& model, const std::string& camera, const std::vector<double>& times_s,
                        const std::function<cv::Mat(int)>& frame_bgr);

}  // namespace vantage
