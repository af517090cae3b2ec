#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "schema/formats/camera.h"

namespace vantage {

/// One image of a group, as reconstruction works on it.
struct View {
  ImageId id;
  int camera = 0;     ///< number of the physical camera in the group
  double time_s = 0;  ///< since ViewGroup::reference_time_s
  Pinhole pinhole;    ///< of the reduced image
  RigidTransform cam_from_world;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< camera centre in the world
  cv::Mat1f grey;                                    ///< 0–255, reduced
  cv::Mat3b bgr;                                     ///< reduced
  bool main = false;  ///< the camera's frame nearest to the group's middle: where patches are expanded
};

/// Set of views of a group, bit k = view k.
using ViewSet = std::uint64_t;
constexpr int kMaxViews = 64;

/// The images that are reconstructed together (Klose et al. 2011, §6.1): at most kMaxViews.
struct ViewGroup {
  std::vector<View> views;
  int num_cameras = 0;
  double reference_time_s = 0;     ///< shot time of t = 0: the middle of the group
  double first_s = 0, last_s = 0;  ///< shot times of the first and the last image
  double duration_s() const { return last_s - first_s; }
  const View& view(int k) const { return views[static_cast<std::size_t>(k)]; }
  int num_views() const { return static_cast<int>(views.size()); }
};

/// An image at full size, with its shot time.
struct GroupImage {
  ImageId id;
  double time_s = 0;
  Pinhole pinhole;
  RigidTransform cam_from_world;
  cv::Mat3b bgr;
};

/// level: how often images are halved; -1: until none is wider than kAutoWidthPx.
constexpr int kAutoWidthPx = 1280;
ViewGroup make_view_group(const std::vector<GroupImage>& images, int level);

/// Direction (not unit; depth along the optical axis is 1) of the ray through a pixel, in the world.
Eigen::Vector3d world_ray(const View& view, const Eigen::Vector2d& px);
/// Pixel and depth along the optical axis of a world point.
struct Projection {
  Eigen::Vector2d px;
  double depth;
};
Projection project(const View& view, const Eigen::Vector3d& point);
bool inside(const View& view, const Eigen::Vector2d& px, double margin_px);

}  // namespace vantage
