#pragma once
#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <utility>
#include <vector>

#include "schema/formats/camera.h"

namespace vantage {

/// A recorded image as a point of the navigation space (Klose et al. 2011, §5.1).
struct NavVertex {
  ImageId image;
  double azimuth_deg = 0, elevation_deg = 0, time_s = 0;
};

/// navspace.json: the sphere's frame, the images on it and how they are joined.
/// axes: rows right, up, front; right × up = front; front points from the centre to where azimuth is 0.
/// With d = axes * (camera centre - centre): azimuth = atan2(d0, d2), elevation = atan2(d1, hypot(d0, d2)).
struct Navspace {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  double radius = 1;
  std::vector<NavVertex> vertices;
  std::vector<std::vector<int>> simplices;  ///< vertex indices, one more than there are dimensions that vary
  std::vector<std::pair<int, int>> edges;   ///< each once, first < second
};

Navspace read_navspace(const std::filesystem::path& navspace_artifact);
void write_navspace(const std::filesystem::path& file, const Navspace& navspace);

}  // namespace vantage
