#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "schema/formats/camera.h"
#include "schema/formats/clocks.h"

namespace vantage::align {

/// A static camera: one pose, one clock.
struct JointCamera {
  Pinhole lens;
  RigidTransform cam_from_world;
  CameraClock clock;    ///< offset_std_s: how sure the pairs are of it
  double frame_s = 0;   ///< time between its frames
  double middle_s = 0;  ///< of its footage: where errors of offset and rate are nearly independent
};

/// A point of the background, and where cameras see it: undistorted pixels.
struct StillPoint {
  struct Sight {
    std::size_t camera = 0;
    Eigen::Vector2d px = Eigen::Vector2d::Zero();
  };
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::vector<Sight> seen;
};

/// A moving point's path in one camera: footage times (rising) and undistorted pixels.
struct MovingTrack {
  std::size_t camera = 0;
  std::vector<double> times_s;
  std::vector<Eigen::Vector2d> px;
};

/// Tracks of one point, in two cameras or more.
struct MovingPoint {
  std::vector<MovingTrack> tracks;
};

/// What is adjusted. cameras[0] is the reference, whose clock stays.
struct JointScene {
  std::vector<JointCamera> cameras;
  std::vector<StillPoint> still;
  std::vector<MovingPoint> moving;
  bool known_cameras = true;  ///< poses and focal lengths stay
};

}  // namespace vantage::align
