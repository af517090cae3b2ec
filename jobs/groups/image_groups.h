#pragma once
/// Which images are reconstructed together. Light: the splits of reconstruct and of fuse plan with it.
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "jobs/job_kind.h"
#include "schema/formats/camera.h"

namespace vantage {

/// A camera with a clock and at least one pose.
struct GroupCamera {
  std::string name;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d forward = Eigen::Vector3d::UnitZ();  ///< optical axis, world
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();       ///< world
  struct Image {
    int frame;
    double time_s;
  };
  std::vector<Image> images;  ///< those with a pose, in order of time
};

constexpr int kMaxGroupCameras = 8;
constexpr int kMaxGroupImages = 64;

/// Neighbourhoods of at most kMaxGroupCameras cameras in order of azimuth about the point they look at, overlapping by
/// half; as camera indices. A ring of cameras is treated as one.
std::vector<std::vector<int>> camera_neighbourhoods(const std::vector<GroupCamera>& cameras);

/// Windows of group_frames frames in time, overlapping by half, times neighbourhoods. Cameras with one image each make
/// a single window. Groups of fewer than 3 images or 2 cameras are left out; groups never exceed kMaxGroupImages.
std::vector<std::vector<ImageId>> image_groups(const std::vector<GroupCamera>& cameras, int group_frames);

/// Default of [reconstruct] group_frames.
constexpr int kDefaultGroupFrames = 4;

/// The shot's groups in the order of their job numbers; nothing while calibration, clocks or frames are not there yet.
std::optional<std::vector<std::vector<ImageId>>> planned_groups(const ShotState& state);
/// Job that reconstructs group `number`: "reconstruct/0003".
std::string group_job_name(std::size_t number);

}  // namespace vantage
