#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace vantage {

/// Where a camera saw a point of the calibration.
struct PointObservation {
  int point = 0;  ///< index into Calibration::points
  std::string camera;
  std::optional<int> frame;                      ///< empty: a static camera's background, there at all times
  Eigen::Vector2d px = Eigen::Vector2d::Zero();  ///< in the footage's pixels, through the lens as filmed
};

/// observations.txt, beside a COLMAP text model: a line `POINT3D_ID CAMERA FRAME X Y` each, FRAME is - for "at all
/// times". POINT3D_ID counts from 1, as in the points3D.txt that write_calibration() writes.
void write_observations(const std::filesystem::path& file, const std::vector<PointObservation>& observations);

/// Throws Error(BadInput) with file and line.
std::vector<PointObservation> read_observations(const std::filesystem::path& file);

}  // namespace vantage
