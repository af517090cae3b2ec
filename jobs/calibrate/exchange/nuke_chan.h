#pragma once
/// Nuke's .chan: one line per frame, `frame tx ty tz rx ry rz vfov`: the camera's place, its turn about x, y and z in
/// degrees, applied in Nuke's own order ZXY (first about z, last about y), and the vertical angle of view in degrees.
/// Nuke's world has y up and its cameras look along -z: ours (y down, cameras along +z) turned half round x.
/// The format knows neither principal point nor lens: a camera is written as if its axis met the picture's centre.
#include <filesystem>
#include <map>

#include "schema/formats/camera.h"

namespace vantage {

struct ChanCamera {
  std::map<int, RigidTransform> cam_from_world;  ///< by frame, our axes
  double vfov_deg = 0;                           ///< of the first frame
};

/// Throws Error(BadInput) with file and line: too few numbers, an angle of view that is none, no frame.
ChanCamera read_chan(const std::filesystem::path& file);

/// Frames in rising order.
void write_chan(const std::filesystem::path& file, const Pinhole& pinhole,
                const std::map<int, RigidTransform>& cam_from_world);

/// A pinhole of that angle of view, centred, with square pixels.
Pinhole pinhole_of_vfov(double vfov_deg, int width, int height);

}  // namespace vantage
