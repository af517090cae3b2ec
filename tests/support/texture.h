#pragma once
#include <Eigen/Core>

namespace vantage::synthetic {

/// Colour (BGR, 0–1) of a solid texture at a point of an object's own frame: five octaves of value noise, 0.6 m down to
/// 3 cm, around a hue that depends on the object. Smooth, never periodic, the same on every machine.
Eigen::Vector3d solid_texture(int object_id, const Eigen::Vector3d& point);

}  // namespace vantage::synthetic
