#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <vector>

#include "schema/formats/camera.h"

namespace vantage {

struct SparsePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3i rgb = Eigen::Vector3i::Zero();
  double error_px = 0;
  std::vector<ImageId> seen_in;  ///< images that hold it, when known
};

/// A COLMAP text model: cameras.txt, images.txt, points3D.txt and, where undistorted pixels are not the footage's,
/// cameras_distorted.txt. Image names are <camera>/<frame:06d>.png.
struct Calibration {
  std::map<std::string, CameraModel> cameras;        ///< by name
  std::map<ImageId, RigidTransform> cam_from_world;  ///< every image that has a pose
  std::vector<SparsePoint> points;

  const CameraModel& camera(const std::string& name) const;  ///< throws Error(Bug) when there is none
  const RigidTransform& pose(const ImageId& image) const;    ///< throws Error(Bug) when there is none
};

/// Throws Error(BadInput) with file and line for a model that cannot be used.
/// With a lens model in cameras.txt and no cameras_distorted.txt, `pinhole` holds the lens's own focal lengths and
/// centre and `filmed` the lens.
Calibration read_calibration(const std::filesystem::path& folder);
void write_calibration(const std::filesystem::path& folder, const Calibration& calibration);

}  // namespace vantage
