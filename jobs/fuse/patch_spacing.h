#pragma once
#include <vector>

#include "jobs/fuse/fuse_patches.h"
#include "schema/formats/calibration.h"

namespace vantage {

/// How wide a pixel is on a surface: depth / focal length of the camera that sees the point at the finest scale, world
/// units. One pose per camera is looked at. A point that no camera sees gets the nearest camera's.
class PixelFootprint {
 public:
  explicit PixelFootprint(const Calibration& calibration);
  double operator()(const Eigen::Vector3f& point, const Eigen::Vector3f& normal) const;

 private:
  struct Camera {
    Pinhole pinhole;
    RigidTransform cam_from_world;
  };
  std::vector<Camera> cameras_;
};

/// Spacing as a multiple of the footprint. The multiple is measured: the median over a sample of patches of the
/// distance to the nearest patch of the same group, since patches do not say how densely they were made.
PatchSpacing measure_spacing(const std::vector<std::vector<Patch>>& groups, const PixelFootprint& footprint);

}  // namespace vantage
