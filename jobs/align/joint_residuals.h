#pragma once
/// Cost functions of the joint adjustment. Blocks: clock {shot time of the footage's middle, rate}, pose {angle-axis,
/// translation: cam from world}, focal {fx}, points in the world, bias in px.
#include <ceres/rotation.h>

#include "jobs/align/joint_path.h"

namespace vantage::align {

/// Pixel of a point in the world through a lens whose fx is not its own.
template <class T>
void project(const Pinhole& lens, const T* pose, const T* focal, const T* point, T* px) {
  T in_cam[3];
  ceres::AngleAxisRotatePoint(pose, point, in_cam);
  for (int i = 0; i < 3; ++i) in_cam[i] += pose[3 + i];
  px[0] = focal[0] * in_cam[0] / in_cam[2] + lens.cx;
  px[1] = focal[0] * (lens.fy / lens.fx) * in_cam[1] / in_cam[2] + lens.cy;
}

struct StillResidual {
  Pinhole lens;
  Eigen::Vector2d px;
  double std_px;
  template <class T>
  bool operator()(const T* pose, const T* focal, const T* point, T* residual) const {
    T seen[2];
    project(lens, pose, focal, point, seen);
    for (int i = 0; i < 2; ++i) residual[i] = (seen[i] - px[i]) / std_px;
    return true;
  }
};

/// A sample of a moving point. Which piece of the spline it lies on is settled when the problem is built: pieces join
/// with two derivatives, so that going on along one for a small fraction of it makes no difference.
struct MovingResidual {
  Pinhole lens;
  double since_middle_s;         ///< footage time less the footage's middle
  double piece_begin_s, knot_s;  ///< of the piece of the spline
  Eigen::Vector2d px;
  double std_px;
  template <class T>
  bool operator()(const T* clock, const T* pose, const T* focal, const T* c0, const T* c1, const T* c2, const T* c3,
                  const T* bias, T* residual) const {
    const T time_s = clock[0] + clock[1] * since_middle_s;
    const std::array<T, 4> w = spline_weights(T((time_s - piece_begin_s) / knot_s));
    T point[3], seen[2];
    for (int i = 0; i < 3; ++i) point[i] = w[0] * c0[i] + w[1] * c1[i] + w[2] * c2[i] + w[3] * c3[i];
    project(lens, pose, focal, point, seen);
    for (int i = 0; i < 2; ++i) residual[i] = (seen[i] + bias[i] - px[i]) / std_px;
    return true;
  }
};

struct BendResidual {
  double std;
  template <class T>
  bool operator()(const T* c0, const T* c1, const T* c2, T* residual) const {
    for (int i = 0; i < 3; ++i) residual[i] = (c0[i] - 2.0 * c1[i] + c2[i]) / std;
    return true;
  }
};

/// How far each number of a block is from what it is thought to be.
template <int N>
struct PriorResidual {
  std::array<double, N> mean, std;
  template <class T>
  bool operator()(const T* value, T* residual) const {
    for (std::size_t i = 0; i < N; ++i) residual[i] = (value[i] - mean[i]) / std[i];
    return true;
  }
};

}  // namespace vantage::align
