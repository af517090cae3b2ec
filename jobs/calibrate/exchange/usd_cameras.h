#pragma once
#include <filesystem>

#include "schema/formats/calibration.h"

namespace vantage {

/// Cameras and sparse points as a USD scene in text form (.usda), y up, for Houdini, Maya, Blender, Unreal: a UsdGeom
/// Camera each with time samples on its own frames (time code = frame number), and a UsdGeom Points. Focal length and
/// apertures are in the tenths of a world unit that USD prescribes, for a sensor 36 mm wide; the principal point is
/// kept as aperture offset. metres_per_unit: 0 when the world's size is not known.
void write_usd_cameras(const std::filesystem::path& file, const Calibration& calibration, double metres_per_unit);

}  // namespace vantage
