#pragma once
/// Static cameras as OpenCV's words in a TOML file, the form that Pose2Sim and Caliscope exchange: a table per camera
/// with `size = [width, height]`, `matrix` (3x3, pixel centres at whole numbers), `distortions` (k1 k2 p1 p2 and up to
/// k3 … k6), `rotation` (Rodrigues' vector or 3x3) and `translation`: x_cam = R x_world + t. `name`, if there is one,
/// names the camera, else the table does. A table `metadata` is passed over.
#include <filesystem>

#include "schema/formats/calibration.h"

namespace vantage {

/// A pose for frame 0 of every camera, no points. Throws Error(BadInput) with the file and the table: a key is missing
/// or has another shape, a fisheye lens, more lens terms than are known, no camera.
Calibration read_camera_toml(const std::filesystem::path& file);

/// The lens as filmed and the pose of each camera's first image.
void write_camera_toml(const std::filesystem::path& file, const Calibration& calibration);

}  // namespace vantage
