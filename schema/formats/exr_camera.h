#pragma once
/// Frames of a film for compositing: what EXR's standard attributes say of them.
#include <filesystem>
#include <vector>

#include "schema/formats/camera.h"
#include "schema/formats/exr.h"

namespace vantage {

struct ExrCamera {
  Pinhole pinhole;
  RigidTransform cam_from_world;
  double fps = 0;
};

/// write_exr with a camera for each part: the attributes framesPerSecond, worldToCamera (x right, y up, z forward) and
/// worldToNDC (0–1, y down), matrices for row vectors as OpenEXR has them.
void write_exr(const std::filesystem::path& path, const std::vector<ExrPart>& parts,
               const std::vector<ExrCamera>& cameras);

}  // namespace vantage
