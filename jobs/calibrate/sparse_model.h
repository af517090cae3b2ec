#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "schema/formats/camera.h"

namespace vantage {

/// A reconstruction that can still be refined: what COLMAP writes, with the pictures' measurements.
/// Lenses by camera name; px in the footage's pixels, centres at +0.5.
struct SparseModel {
  struct Point {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3i rgb = Eigen::Vector3i::Zero();
  };
  struct Observation {
    ImageId image;  ///< whose pose holds
    int point = 0;  ///< index into points
    Eigen::Vector2d px = Eigen::Vector2d::Zero();
    int feature = 0;                ///< number among the image's features
    std::optional<int> frame = {};  ///< when it was there; empty: a static camera's background, at all times
    Eigen::Vector2d carried_px = Eigen::Vector2d::Zero();  ///< px less where it is in that frame
  };
  std::map<std::string, LensModel> lenses;
  std::map<ImageId, RigidTransform> cam_from_world;
  std::vector<Point> points;
  std::vector<Observation> observations;

  /// Distinct cameras that have a pose.
  int num_cameras() const { return static_cast<int>(lenses.size()); }
};

/// Reads COLMAP's text model, whose images are named <camera>/<frame:06d>.png with one COLMAP camera per folder.
/// Cameras without a pose are left out. Throws Error(Bug) for what COLMAP does not write.
SparseModel read_sparse_model(const std::filesystem::path& folder);

}  // namespace vantage
