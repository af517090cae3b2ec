#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "schema/formats/calibration.h"
#include "schema/formats/frame_table.h"

namespace vantage {

/// A camera of the shot as calibration sees it.
struct FilmedCamera {
  FrameTable table;
  bool moving = false;
  std::optional<double> start_s;  ///< shot time of its first frame, when its clock is known to be exact
};

struct KnownCalibration {
  Calibration calibration;
  std::vector<std::string> warnings;  ///< sentences
};

/// A model made to fit the shot: its cameras only, a pose for every frame (a static camera's pose holds for all its
/// frames), lenses turned into pinholes with the lens as filmed beside them. The world stays as it is. model: a folder
/// with a COLMAP text model, or a TOML file of OpenCV cameras (exchange/camera_toml.h).
/// Throws Error(BadInput) naming the camera: not in the model, another picture size, no pose.
KnownCalibration known_calibration(const std::filesystem::path& model, const std::vector<FilmedCamera>& cameras);

/// The same from a Nuke .chan file per camera, by camera name.
KnownCalibration known_from_chan(const std::map<std::string, std::filesystem::path>& files,
                                 const std::vector<FilmedCamera>& cameras);

}  // namespace vantage
